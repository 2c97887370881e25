#!/usr/bin/env bash
# Paints the pictures of docs/diagnosis.md anew, beside this file.
#
#   docs/diagnosis/pictures.sh [PATH-OF-POSESCOPE]
set -euo pipefail
posescope=$(realpath "${1:-target/debug/posescope}")
cd "$(dirname "$0")"

# What some pictures need beside the street itself: photos whose camera is stated with too long a focal
# length, an index of every tenth frame, and poses of another system that has none of the query.
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
"$posescope" synth "$made" --layout toml --condition overcast --every 200 --quiet
sed -i 's/^\(f[xy]\) = .*/\1 = 900/' "$made/overcast/scene.toml"
"$posescope" index street --every 10 --set index.words=1000 --out "$made/street.index" --quiet
echo 000450 1 0 0 0 0 0 0 > "$made/poses.txt"

# NAME SCENE QUERIES QUERY REFERENCE AT [ARGUMENTS OF ITS OWN …]
picture() {
    local reference=()
    [ "$5" = retrieved ] || reference=(--reference "$5")
    "$posescope" view "$2" --query-scene "$3" --query "$4" "${reference[@]}" --at "$6" \
        --window 1280x720 --screenshot "$1.jpg" "${@:7}"
}
picture X1 street "$made/overcast" 600 600 fb --method fb --set surf.max_keypoints=150
picture R1 street:snow street:night 138 122 fb
picture R2 street street 589 583 fb --method fb --degrade fog=0.9
picture R3 street:snow street:night 450 450 fb
picture R4 street street 589 583 fb --method fb --set surf.max_keypoints=600 --set fb.depth_radius=0.3
picture R5 street street:sun 322 333 fb --method fb --set surf.max_keypoints=400
picture R6 street street 589 583 fb --method fb --set surf.max_keypoints=600 --set fb.max_trials=2
picture R7 street street:rain 203 207 fb --method fb
picture R8 street street 802 789 fb
picture R9 street street 589 574 fb --method fb,mi --radius 8
picture D1 street:snow street:night 212 217 pm
picture D2 street:snow street:night 169 178 mi
picture D3 street:snow street:night 450 450 mi
picture D4 street:snow street:night 138 122 mi
picture D5 street street 589 583 mi --method mi --degrade fog=1
picture D6 street:snow street:night 356 357 pm
picture D7 street street 583 589 mi
picture D8 street street:rain 390 399 pm --method pm
picture H1 street street:sun 167 153 hy --method fb,mi,hy
picture F1 street street:rain 224 219 fb --method fb --reference 218 --reference 237 --fusion avg
picture F2 street street 589 583 end --method mi6 --reference 595 --fusion joint
picture V1 street street:snow 75 retrieved end --method fb --reference retrieve:1 --prior 100 \
    --index "$made/street.index"
picture E1 street street 589 583 end --method other,mi --estimates other="$made/poses.txt"
picture L1 street:snow street:night 406 397 mi --method mi
# A photo of another street, whose true pose nobody states.
"$posescope" view street --query "$made/overcast/photos/000400.png" --reference 300 --method fb --at fb \
    --camera 718.856,718.856,607.1928,185.2157 --window 1280x720 --screenshot N1.jpg
