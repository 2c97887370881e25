#!/usr/bin/env bash
# Measures a graphics card against all cores of its machine, and checks that both give the same bytes.
#
#   studies/card.sh build FOLDER      builds the two programs into FOLDER, where there is a network
#   studies/card.sh FOLDER            runs them: no network, no display, no question, at most eight minutes
#   studies/card.sh --small FOLDER    tries the script on a software adapter, with a coarse surface
#
# Prints hypotheses per second at 16,384 and 500,000 points, the time of a dense surface of the 10 m disc on the card
# and on the threads in turn, and whether surfaces and results are equal. It ends with an error where they are not, and
# where there is no card.
set -euo pipefail

if [ "${1:-}" = build ]; then
    out=$(realpath -m "$2")
    cd "$(dirname "$0")/.."
    cargo build --locked --release --bin posescope
    cargo build --locked --release -p posescope-gpu --example hypotheses
    mkdir -p "$out"
    target=${CARGO_TARGET_DIR:-target}/release
    cp "$target/posescope" "$target/examples/hypotheses" "$out"
    exit
fi
surface=()
if [ "${1:-}" = --small ]; then
    surface=(--set surface.step=2 --set surface.yaw_step=5)
    shift
fi
folder=$(realpath "$1")
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
pair=(run street --query 70 --reference 62 --radius 10 --quiet)

# The clock of one command [s].
clock() {
    local begun=$EPOCHREALTIME
    "$@" >/dev/null
    awk -v a="$begun" -v b="$EPOCHREALTIME" 'BEGIN { printf "%.2f", b - a }'
}

echo "== hypotheses per second"
timeout 240 "$folder/hypotheses"

echo "== a dense surface of the 10 m disc, by the clock"
for round in 1 2; do
    for where in gpu cpu; do
        seconds=$(clock timeout 45 "$folder/posescope" "${pair[@]}" --method mi --compute "$where" "${surface[@]}" \
            --surface "$made/$where.csv")
        echo "round $round, $where: $seconds s"
    done
done

echo "== the same bytes"
for where in gpu cpu; do
    timeout 30 "$folder/posescope" "${pair[@]}" --method pm,mi,nid --compute "$where" \
        --json "$made/$where.jsonl" >/dev/null
done
cmp "$made/gpu.csv" "$made/cpu.csv" && echo "surfaces are equal: $(wc -l <"$made/gpu.csv") lines"
cmp "$made/gpu.jsonl" "$made/cpu.jsonl" && echo "results are equal: $(wc -l <"$made/gpu.jsonl") methods"
