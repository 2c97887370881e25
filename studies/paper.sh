#!/usr/bin/env bash
# Makes the figures of docs/paper.md again.
#
#   studies/paper.sh PROGRAM STUDIES OUT
#
# PROGRAM is posescope, STUDIES the program of the studies. OUT/differences.md and OUT/pair.md say what each
# difference to the paper changes; OUT/hybrid.md compares the two rules of HY. The runs in OUT/single, OUT/across,
# OUT/multi and OUT/large are the paper's experiments with the street in the place of KITTI and RobotCar.
set -euo pipefail
program=$1
studies=$2
out=$3
mkdir -p "$out"

methods=(--method fb)
for change in fb.fourth=true fb.local=false fb.accept=paper fb.radius_slack=100 surf.upright=false fb.ratio=0.775; do
    methods+=(--method "fb $change")
done
methods+=(--method "fb paper" --method pm)
for change in pm.power=2 grid.coverage_floor=0 render.visibility=false render.splat_px=3; do
    methods+=(--method "pm $change")
done
methods+=(--method "pm paper" --method mi)
for change in grid.coverage_floor=0 render.visibility=false render.splat_px=3; do
    methods+=(--method "mi $change")
done
methods+=(--method "mi paper")
"$studies" methods --street 12 --seed 5 --cells all "${methods[@]}" >"$out/differences.md"
if [ -n "${POSESCOPE_DATA:-}" ]; then
    "$studies" methods --scene "$POSESCOPE_DATA/kitti/sequences/00" --radius 15 "${methods[@]}" >"$out/pair.md"
else
    echo "skipped: no data (POSESCOPE_DATA)"
fi

# A run that is there already goes on.
run() { # NAME ARGUMENTS…
    local name=$1 resume=()
    shift
    [ -d "$out/$name" ] && resume=(--resume)
    "$program" eval "$@" --out "$out/$name" --keep-failures 0 --quiet "${resume[@]}" >/dev/null
}

run single street:overcast --preset single --limit 40
run across street:sun --query-scene street:snow --preset single --limit 40
run multi street:overcast --preset multi --limit 40

scenes=() queries=()
for condition in overcast sun night rain snow; do
    [ -f "$out/$condition.index" ] || "$program" index "street:$condition" --every 2 --out "$out/$condition.index" --quiet
    scenes+=("street:$condition" --index "$out/$condition.index")
    queries+=(--query-scene "street:$condition")
done
run large "${scenes[@]}" "${queries[@]}" --preset large --prior 50 --failure-radius 20 --limit 40
run query street:night --query-scene street --reference random:5 --limit 40 --method fb,mi,hy --fusion r-wavg --failure-radius 20
run reference street:night --query-scene street --reference random:5 --limit 40 --method fb,mi,hy --fusion r-wavg --failure-radius 20 --set hy.per_reference=true
for name in single across multi large query reference; do
    "$program" results "$out/$name" --table summary --as markdown >"$out/$name.md"
done
for number in 3 4 6; do
    for name in single across multi large; do
        "$program" results "$out/$name" --table "paper:$number" --as markdown >"$out/$name-$number.md" || true
    done
done
"$program" results "$out/single" --plot solved --out "$out/figure-11.svg"
"$program" results "$out/multi" --plot solved --out "$out/figure-12.svg"
