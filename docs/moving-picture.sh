#!/usr/bin/env bash
# Paints docs/lockstep.gif: one query, four methods, step by step. Needs ImageMagick.
#   docs/moving-picture.sh [POSESCOPE]
set -euo pipefail
cd "$(dirname "$0")/.."

posescope=${1:-target/debug/posescope}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

number=100
for step in 0 6 9 11 13 20 40 60 80 120 160 200 240 280 320 400 480 560 640 720 760 800 840 870 900 936; do
    number=$((number + 1))
    "$posescope" --quiet shot street --query 70 --reference 62 --view lockstep --lockstep "$step" \
        --size 1000x640 --out "$work/$number.png"
done
# The last picture stays.
convert -delay 45 "$work"/*.png -delay 300 "$work/$number.png" -loop 0 \
    +dither -colors 96 -layers OptimizeTransparency docs/lockstep.gif
ls -l docs/lockstep.gif
