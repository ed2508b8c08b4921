# A planar OBJ mesh as the program of the paper's scheme reads it: counts, "x y boundary", triangles from 0.
$1 == "v" { at[n++] = $2 " " $3 }
$1 == "f" {
    for (k = 1; k <= 3; k++) {
        sub("/.*", "", $(k + 1))
        corner[t + 0, k] = $(k + 1) - 1
    }
    for (k = 1; k <= 3; k++) {
        a = corner[t + 0, k]; b = corner[t + 0, k % 3 + 1]
        uses[a < b ? a " " b : b " " a]++
    }
    t++
}
END {
    for (edge in uses) if (uses[edge] == 1) { split(edge, end); boundary[end[1]] = boundary[end[2]] = 1 }
    print n, t
    for (i = 0; i < n; i++) print at[i], boundary[i] + 0
    for (i = 0; i < t; i++) print corner[i, 1], corner[i, 2], corner[i, 3]
}
