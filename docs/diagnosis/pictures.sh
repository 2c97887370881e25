#!/usr/bin/env bash
# Paints the pictures of docs/diagnosis.md anew, beside this file.
#
#   docs/diagnosis/pictures.sh [PATH-OF-POSESCOPE]
set -euo pipefail
posescope=$(realpath "${1:-target/debug/posescope}")
cd "$(dirname "$0")"

# NAME SCENE QUERIES QUERY REFERENCE VIEW AT
picture() {
    local view=()
    [ "$6" = whole ] || view=(--view "$6")
    "$posescope" shot "$2" --queries "$3" --query "$4" --reference "$5" "${view[@]}" --at "$7" \
        --size "$size" --out "$1.jpg" "${more[@]}"
}
size=1500x950
more=(--explain)
picture card street:snow street:night 450 450 whole mi
size=800x440
more=()
picture D1 street:snow street:night 212 217 surface pm
picture D2 street:snow street:night 169 178 surface mi
picture D3 street:snow street:night 450 450 surface mi
picture D4 street:snow street:night 138 122 surface mi
picture D6 street:snow street:night 356 357 synthetic pm
picture D7 street street 583 589 histogram mi
picture R1 street:snow street:night 138 122 space fb
picture R3 street:snow street:night 450 450 images fb
picture R8 street street 802 789 images fb
