#!/usr/bin/env bash
# Runs what a change of the inside must not alter, for `studies same-results` to compare.
#
#   studies/baseline.sh PROGRAM OUT
#
# Writes one run folder per case into OUT: the five conditions of the street against overcast at 20 places
# with eight methods, one fusion experiment, one descent, and, where POSESCOPE_DATA is set, the KITTI pair
# both ways and 7-Scenes.
set -euo pipefail
program=$1
out=$2
mkdir -p "$out"
methods=fb,pm,mi,hy,nid,fb2,mi6,robust

run() { # NAME ARGUMENTS…
    local name=$1
    shift
    "$program" eval "$@" --out "$out/$name" --quiet
}

for condition in overcast sun night rain snow; do
    run "$condition" street:overcast --query-scene "street:$condition" --limit 20 --method "$methods"
done
run fusion street:night --query-scene street:overcast --reference random:3 --limit 8 --method fb,mi,fb2,nid --fusion maxf,avg,wavg,r-wavg,joint
run descent street:overcast --query-scene street:rain --limit 10 --method pm,mi --set pm.search=descent --set mi.search=descent
if [ -n "${POSESCOPE_DATA:-}" ]; then
    run kitti "$POSESCOPE_DATA/kitti/sequences/00" --radius 15 --method "$methods"
    run 7scenes "$POSESCOPE_DATA/7scenes/redkitchen" --limit 6 --method "$methods"
else
    echo "skipped: no data (POSESCOPE_DATA)"
fi
