#!/usr/bin/env bash
# Measures how time and memory of a run grow, one thing at a time, and prints a table: the README's page on scaling.
# Usage: examples/scaling.sh [VSONAR], from anywhere; needs GNU time. Takes about ten minutes on two cores.
set -euo pipefail
vsonar=${1:-vsonar}
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"

# synth NAME FRAMES SIZE: a data folder.
synth() { "$vsonar" data synth "$1" --frames "$2" --size "$3" >/dev/null; }

# run LABEL DATA FLAGS...: the median of three seeds by wall time, and the largest memory.
run() {
    local label=$1 data=$2 seed
    shift 2
    : >times
    for seed in 1 2 3; do
        rm -rf run
        /usr/bin/time -a -o times -f '%e %M' "$vsonar" evolve --preset paper "${settings[@]}" --data "$data" --seed "$seed" --out run --quiet "$@" >/dev/null
        sed -n 's/.*"executed":\([0-9]*\).*/\1/p' run/log.jsonl | awk '{ n += $1 } END { print n }' >>executed
    done
    local fresh
    fresh=$(sort -n executed | sed -n 2p)
    rm executed
    sort -n times | awk -v label="$label" -v fresh="$fresh" \
        '{ t[NR] = $1; if ($2 > m) m = $2 } END { printf "%-34s %7.1f s (%.1f to %.1f) %9d fresh %6.0f MB\n", label, t[2], t[1], t[3], fresh, m / 1000 }'
}

# Two trees, all nodes and no altered copies: what `default` was at first, so that tables of all revisions compare.
settings=(--set creation.plain_column_probability=0.7 --set filter.enabled=true --set selection.kind=sharing)

synth f60 60 320x240
for n in 1000 2000 4000 8000; do run "population $n" f60 --population $n; done
for n in 26 51 101; do run "generations $n" f60 --generations $n; done
for n in 15 30 120 240; do synth f$n $n 320x240; run "cases $((n * 6))" f$n; done
for size in 160x120 640x480; do synth s$size 60 $size; run "image $size" s$size; done
for n in 10 13 17 25; do run "depth limit $n" f60 --set "breeding.max_depth=$n"; done
for n in 1 2; do run "threads $n" f60 --threads $n; done
