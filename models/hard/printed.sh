#!/usr/bin/env bash
# The paper's scheme (explicit Euler, steepest descent after each step) as a program of its own does it, on the disc of
# a hard case, for the rows beside it in the table. $BENCH is the folder with its source, seed/seed_baseline.c.
#
#   printed.sh RADIUS VERTICES OPTION...     options of that program
set -euo pipefail
radius=$1 vertices=$2
shift 2
gcc -O3 -march=native -fopenmp -o printed "$BENCH/seed/seed_baseline.c" -lm
"$RUMPLE" mesh generate disc radius="$radius" --vertices "$vertices" --seed 1 --out disc.obj > mesh.log
awk -f "$MODELS/hard/printed.awk" disc.obj > disc.txt
OMP_NUM_THREADS=1 ./printed disc.txt --grad an --amax 1.5 --tolF 5e-3 --wall 50 --out frame "$@" > log
awk '/^t / { for (k = 1; k < NF; k++) if ($k == "U") energy = $(k + 1) }
     /^END/ { for (k = 1; k < NF; k++) seen[$k] = $(k + 1)
              printf "%d steps to t = %g in %.0f s, total energy %s\n", seen["steps"], seen["t"], seen["cpu"], energy }' log
