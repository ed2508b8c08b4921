#!/usr/bin/env bash
# The figures of Zakharov & Dasbiswas (2021), a command each, beside docs/book/verification/figures.md:
#
#     models/paper/figures.sh evolution        runs it, prints its numbers, draws its picture
#     models/paper/figures.sh                  lists the figures
#
# Results and pictures go to results/paper (FIGURES=DIR for another folder); of sweeps, NAME/report.html. A run that
# is complete is not repeated, unless its scene or its keys have changed; after a change of the program remove its
# folder. CHECK=1 only checks that every scene can be run. Run from anywhere; needs `cargo build --release`
# and what `tests/run.sh` installs (ParaView, Python with VTK).
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
rumple="${RUMPLE:-$here/target/release/rumple}"
out="${FIGURES:-$here/results/paper}"
python="${RUMPLE_PYTHON:-$here/target/venv/bin/python}"
model_i="$here/models/paper/model-i.toml"
model_ii="$here/models/paper/model-ii.toml"
sphere="$here/models/paper/sphere.toml"
loose="$here/models/paper/loose.toml"

# complete DIR SCENE [--set KEY=VALUE ...]: whether DIR has all of this scene with these keys
complete() {
    local dir=$1 wanted
    shift
    grep -qs '"status": "complete"' "$dir/status.json" || return 1
    wanted=$("$rumple" check --resolved "$@") || return 1
    [[ $wanted == "$(<"$dir/resolved.toml")" ]]
}

# run NAME SCENE [--set KEY=VALUE ...]
run() {
    local name=$1 scene=$2
    shift 2
    if [[ -n ${CHECK:-} ]]; then
        "$rumple" check "$scene" "$@" >/dev/null
    elif ! complete "$out/$name" "$scene" "$@"; then
        echo "== $name"
        "$rumple" run "$scene" --threads "${THREADS:-1}" --out "$out/$name" --force "$@"
    fi
}

# sweep NAME SCENE --over KEY=VALUES ... [--set KEY=VALUE ...] --level LEVEL: of the first values when checked
sweep() {
    local name=$1 scene=$2
    shift 2
    if [[ -z ${CHECK:-} ]]; then
        echo "== $name"
        "$rumple" sweep "$scene" --out "$out/$name" --threads "${THREADS:-1}" "$@"
        return
    fi
    local sets=()
    while (($#)); do
        case $1 in
        --over) sets+=(--set "${2%%,*}") ;;
        --set) sets+=(--set "$2") ;;
        esac
        shift 2
    done
    "$rumple" check "$scene" "${sets[@]}" >/dev/null
}

# numbers NAME ARRAY LEVEL...: regions, share of the area, d and nearest centres at every output time
numbers() {
    [[ -z ${CHECK:-} ]] || return 0
    "$python" "$here/tests/scripts/measure.py" "$out/$1" --array "$2" --threshold "${@:3}"
}

# draw FIGURE ARRAY COLUMNS NAME:TIME:VIEW...: pictures side by side, all on one scale
draw() {
    [[ -z ${CHECK:-} ]] || return 0
    local figure=$1 array=$2 columns=$3 pictures=() name time view
    shift 3
    for shown in "$@"; do
        IFS=: read -r name time view <<<"$shown"
        pictures+=("$out/.$figure-${#pictures[@]}.png")
        "$here/tests/scripts/render.sh" "$out/$name/sheet.pvd" "${pictures[-1]}" --array "$array" \
            --time "$time" --view "$view" --range "${RANGE:-0,0.65}" --title "$name" >/dev/null
    done
    "$python" "$here/tests/scripts/montage.py" "$out/$figure.png" "${pictures[@]}" \
        --columns "$columns" --width 300 --crop 900,800
    rm -f "${pictures[@]}"
    echo "drew $out/$figure.png"
}

# Model I in time at three thicknesses (the paper's evolution at D = 0, a and b).
evolution() {
    run h0.5 "$model_i" --set time.until=60
    run h1 "$model_i" --set material.thickness=1 --set time.until=140 --set output.every=10
    run h1.5 "$model_i" --set material.thickness=1.5 --set time.until=300 --set output.every=20
    for name in h0.5 h1 h1.5; do numbers $name c 0.1 0.4; done
    draw evolution c 4 h0.5:{4,10,20,30}:top h1:{20,60,100,140}:top h1.5:{60,140,220,300}:top
}

# Model I with a high threshold (the same, c). The initial Gaussian must be above it.
threshold() {
    local high=(--set kinetics.parameters.c_star=0.4 --set kinetics.initial.c.gaussian.amplitude=0.75)
    run c0.4 "$model_i" --set material.thickness=1.5 --set time.until=60 --set output.every=10 "${high[@]}"
    numbers c0.4 c 0.4
    draw threshold c 3 c0.4:{10,20,60}:top
}

# Thickness and diffusion (the paper's map of h and D), on a coarser mesh.
map() {
    sweep map "$model_i" --over material.thickness=1,1.5,2 \
        --over effect.diffusion.coefficient=0,1,10,50 \
        --set sheet.vertices=8000 --set time.until=20 --set output.every=5 --level 0.1
}

# No propagation where the sheet is thick.
thick() {
    sweep thick "$model_i" --over material.thickness=2,3 --set sheet.vertices=8000 --set time.until=300 \
        --set output.every=20 --level 0.1
}

# The same fully relaxed at every time.
relaxed() {
    local set=(--set time.policy=quasi-static --set sheet.vertices=8000 --set time.until=20 --set output.every=4)
    run relaxed-h1 "$model_i" "${set[@]}" --set material.thickness=1
    run relaxed-h1.5 "$model_i" "${set[@]}" --set material.thickness=1.5
    run relaxed-D60 "$model_i" "${set[@]}" --set material.thickness=1 --set effect.diffusion.coefficient=60 \
        --set time.until=8
    for name in relaxed-h1 relaxed-h1.5 relaxed-D60; do numbers $name c 0.1 0.4; done
    draw relaxed c 3 relaxed-h1:{4,12,20}:top relaxed-h1.5:{4,12,20}:top relaxed-D60:{0,4,8}:top
}

# Model I with contact and without, on a smaller disc: densities of 20 000 vertices (h = 0.5) and 8 000 on R = 100.
contact() {
    local contact="$out/contact.toml" small=(--set sheet.radius=50) h1 h15
    sed 's/^\[kinetics\]/[[effect]]\nkind = "contact"\n\n[kinetics]/' "$model_i" >"$contact"
    h1=("${small[@]}" --set sheet.vertices=2000 --set material.thickness=1 --set time.until=140 --set output.every=10)
    h15=("${small[@]}" --set sheet.vertices=2000 --set material.thickness=1.5 --set time.until=300 --set output.every=20)
    small+=(--set sheet.vertices=5000 --set time.until=100 --set output.every=5)
    run none-h0.5 "$model_i" "${small[@]}"
    run contact-h0.5 "$contact" "${small[@]}"
    run none-h1 "$model_i" "${h1[@]}"
    run contact-h1 "$contact" "${h1[@]}"
    run none-h1.5 "$model_i" "${h15[@]}"
    run contact-h1.5 "$contact" "${h15[@]}"
    for name in {none,contact}-h{0.5,1,1.5}; do numbers $name c 0.1 0.4; done
    draw contact c 4 {none,contact}-h0.5:{10,20,45,100}:top {none,contact}-h1:{20,60,100,140}:top
}

# The same fully relaxed, on a disc of R = 35 (h = 0.5) and with D = 60 on one of R = 50.
relaxed_contact() {
    local contact="$out/contact.toml" h05 d60
    sed 's/^\[kinetics\]/[[effect]]\nkind = "contact"\n\n[kinetics]/' "$model_i" >"$contact"
    h05=(--set time.policy=quasi-static --set output.every=1)
    d60=("${h05[@]}" --set sheet.radius=50 --set sheet.vertices=2000 --set material.thickness=1
        --set effect.diffusion.coefficient=60 --set time.until=8)
    h05+=(--set sheet.radius=35 --set sheet.vertices=2450 --set time.until=20)
    run relaxed-none-h0.5 "$model_i" "${h05[@]}"
    run relaxed-contact-h0.5 "$contact" "${h05[@]}"
    run relaxed-none-D60 "$model_i" "${d60[@]}"
    run relaxed-contact-D60 "$contact" "${d60[@]}"
    for name in relaxed-{none,contact}-{h0.5,D60}; do numbers "$name" c 0.1 0.4; done
    draw relaxed-contact c 4 relaxed-{none,contact}-h0.5:{4,8,12,20}:top
}

# The same relaxed loosely, by a plain metric, as printed.
loosely() {
    run loose "$loose"
    numbers loose c 0.1 0.4
    draw loosely c 3 loose:{4,12,30}:top
}

# A closed shell: separation against thickness, and against growth.
shell() {
    sweep shell-thickness "$sphere" --over material.thickness=0.5,0.75,1,1.5 --level 0.25
    sweep shell-growth "$sphere" --over kinetics.parameters.lambda_min=0.65,0.75,0.85,0.92 --level 0.25
}

# Whether d is the model's or the mesh's: densities of 8 000, 20 000 and 80 000 vertices on R = 100.
mesh() {
    sweep mesh-h0.5 "$model_i" --over sheet.vertices=5000,20000 --set sheet.radius=50 \
        --set time.until=20 --set output.every=5 --level 0.1
    sweep mesh-h1 "$model_i" --over sheet.vertices=2000,5000,20000 --set sheet.radius=50 \
        --set material.thickness=1 --set time.until=60 --set output.every=10 --level 0.1
}

# Model II in time.
motors() {
    run motors "$model_ii"
    numbers motors m 0.5
    RANGE=0,1 draw motors m 4 motors:{4,8,20,60}:top
}

# Model II from other starts.
starts() {
    local until=(--set time.until=40)
    run rectangle "$model_ii" "${until[@]}" --set 'kinetics.initial.m={rectangle={size=[40.0,15.0],value=1.0}}'
    run stripe "$model_ii" "${until[@]}" --set 'kinetics.initial.m={stripe={width=6.0,value=1.0}}'
    run two "$model_ii" "${until[@]}" --set "kinetics.initial.m={spots=[
        {centre=[-30.0,0.0,0.0],width=6.0,amplitude=1.0},{centre=[30.0,0.0,0.0],width=6.0,amplitude=1.0}]}"
    for name in rectangle stripe two; do numbers $name m 0.5; done
    RANGE=0,1 draw starts m 3 rectangle:{4,12,40}:top stripe:{4,12,40}:top two:{4,12,40}:top
}

# Model II over the strength of the feedback: a Y = 5, 10, 20, 30, 50, 100, 225, 500, 1000.
feedback() {
    local a=2.2222e-6,4.4444e-6,8.8889e-6,1.3333e-5,2.2222e-5,4.4444e-5,1e-4,2.2222e-4,4.4444e-4
    sweep feedback "$model_ii" --over kinetics.parameters.a=$a --set sheet.radius=50 --set sheet.vertices=5000 \
        --set time.until=60 --set output.every=10 --level 0.5
}

figures=(evolution threshold map thick relaxed contact relaxed_contact loosely shell mesh motors starts feedback)
[[ $# -gt 0 ]] || { echo "figures: ${figures[*]}, or all"; exit 0; }
[[ $1 != all ]] || set -- "${figures[@]}"
failed=()
for figure in "$@"; do
    [[ " ${figures[*]} " == *" $figure "* ]] || { echo "no figure \`$figure\`: ${figures[*]}" >&2; exit 2; }
    mkdir -p "$out"
    # In a shell of its own, so that one that fails does not end the others.
    set +e
    (set -e; "$figure")
    code=$?
    set -e
    ((code == 0)) || failed+=("$figure")
    # Ctrl-C and kill end all of it.
    ((code <= 128)) || exit "$code"
done
((${#failed[@]} == 0)) || { echo "failed: ${failed[*]}" >&2; exit 1; }
