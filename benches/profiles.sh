#!/usr/bin/env bash
# Prints the median of every stage in the dev profile beside that in release, and their ratio:
# `cargo run` and `cargo test` are meant to be as fast as what was measured. A ratio above 1.3 wants a
# crate in `[profile.dev.package]`; `perf record target/debug/posescope …` says which.
#
# Arguments choose other benchmarks than the stages of the estimators: `benches/profiles.sh frame`.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ $# = 0 ]; then
    set -- surf match mlesac p3p estimator hypothesis
fi

medians() {
    cargo bench --quiet -p posescope-stages --profile "$1" -- --sample-count 12 "${@:2}" |
        sed 's/[│├─╰]/ /g' |
        # A row with numbers has four times with their units; the third is the median.
        awk '
            function nanoseconds(number, unit) {
                return number * (unit == "s" ? 1e9 : unit == "ms" ? 1e6 : unit == "ns" ? 1 : 1e3)
            }
            {
                match($0, /^ */)
                indent = RLENGTH
                times = 0
                for (i = 2; i <= NF; i++)
                    if ($i ~ /^(s|ms|µs|ns)$/ && ++times == 3) median = nanoseconds($(i - 1), $i)
                if (times < 3) { if (NF == 1 || $2 ~ /^fastest$/) group[indent] = $1; next }
                name = $1
                for (outer = indent - 1; outer > 0; outer--)
                    if (outer in group) { name = group[outer] "/" name; break }
                print name, median
            }'
}

# One after the other: at the same time they would share the processor's caches.
dev=$(medians dev "$@" | sort)
release=$(medians release "$@" | sort)
join <(echo "$dev") <(echo "$release") |
    awk '
        BEGIN { printf "%-44s %12s %12s %7s\n", "stage", "dev", "release", "ratio" }
        { printf "%-44s %9.3f ms %9.3f ms %7.2f\n", $1, $2 / 1e6, $3 / 1e6, $2 / $3 }'
