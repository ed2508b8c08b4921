# Writes a lattice of 2n × n rows of triangles, stretched along x and sheared, as an OBJ file:
#     awk -v n=12 -v stretch=20 -v shear=3 -f lattice.awk > lattice.obj
# A stretch makes needles, a shear obtuse triangles.
BEGIN {
    for (j = 0; j <= n; j++)
        for (i = 0; i <= n; i++)
            printf "v %.17g %.17g 0\n", stretch * (i + 0.5 * (j % 2)) + shear * j, j * 0.866025403784438647
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++) {
            a = j * (n + 1) + i + 1; b = a + 1; c = a + n + 1; d = c + 1
            if (j % 2 == 0) { print "f", a, b, c; print "f", b, d, c } else { print "f", a, d, c; print "f", a, b, d }
        }
}
