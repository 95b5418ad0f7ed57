#!/usr/bin/env bash
# What every verb writes, as digests: a change that is meant to change no result must leave them alone.
#
#   tests/freeze.sh BINARY            compare with tests/freeze/*.sha256; exit code 1 where anything differs
#   tests/freeze.sh BINARY --update   write them again; the commit says what changed and why
#
# Compare on a processor with AVX-512: elsewhere fits end in other last digits.
#
# The shipped data always; with TRUEGRIND_DATA in the environment the measured sets too. Use a release binary (two
# minutes; five with the measured sets). Kept are JSON, CSV, programs, models and what the terminal shows.
set -euo pipefail

usage() { sed -n '2,10s/^# \{0,1\}//p' "$0" >&2; exit 2; }
[ $# -ge 1 ] || usage
binary="$(realpath "$1")"
mode="${2:-compare}"
case "$mode" in compare | --update) ;; *) usage ;; esac
here="$(cd "$(dirname "$0")" && pwd)"
root="$(dirname "$here")"
kept="$here/freeze"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

# run NAME ARGUMENTS…: one command in a folder of its own below $out; its words and exit code are results too. Inputs are
# named from there, so that no result holds the name of a folder that only this run has.
run() {
  local name="$1" code=0
  shift
  mkdir -p "$out/$name"
  (cd "$out/$name" && COLUMNS=100 NO_COLOR=1 "$binary" "$@" >stdout.txt 2>stderr.txt) || code=$?
  echo "$code" >"$out/$name/exit-code.txt"
}

# digest FILE: the sums of everything below $out, compared or written.
digest() {
  local sums="$kept/$1"
  (cd "$out" && find . -type f | LC_ALL=C sort | xargs sha256sum) >"$work/sums"
  if [ "$mode" = --update ]; then
    mkdir -p "$kept"
    cp "$work/sums" "$sums"
    echo "$sums: $(wc -l <"$sums") files"
  elif diff -u "$sums" "$work/sums" >"$work/difference"; then
    echo "$1: $(wc -l <"$sums") files, all as before"
  else
    grep '^[-+][^-+]' "$work/difference" | awk '{ print substr($1, 1, 1), $2 }' | sort -k2 -u >&2
    echo "$1: the files above differ (-: as kept, +: now)" >&2
    failed=1
  fi
}

failed=0

shipped() {
  out="$work/shipped"
  mkdir -p "$out"
  cp -r "$here/data" "$root/programs" "$root/surfaces" "$root/experiments" "$work"
  local data=../../data cable=../../data/irb120-cable.csv tracker=../../data/irb120-tracker.csv
  local arm=(--robot abb-irb-120)
  run robots robots
  run robot robots abb-irb-120
  for recipe in irb120-cable irb120-tracker irb120-rounded; do
    run "simulate-$recipe" simulate "$data/$recipe.toml" -o data.csv --arm arm.toml --seed 5
    run "identify-$recipe" identify "$data/$recipe.csv" "${arm[@]}" --json result.json --csv table.csv -o model.toml --allow-doubtful
    run "diagnose-$recipe" diagnose "$data/$recipe.csv" "${arm[@]}" --json result.json --csv table.csv -o model.toml --allow-doubtful
  done
  run identify-methods identify "$cable" "${arm[@]}" --compare-methods 2 --json result.json
  for method in ltlm ekf ukf-vslm rls lm-as-printed; do
    run "identify-$method" identify "$tracker" "${arm[@]}" --method "$method" --json result.json
  done
  run plan plan "${arm[@]}" --sensor position --poses 20 --candidates 300 -o poses.mod --json plan.json --csv table.csv
  run plan-for plan "${arm[@]}" --sensor cable --poses 20 --candidates 300 --outlet 500,0,0 \
    --for "../diagnose-irb120-cable/result.json" -o poses.mod --json plan.json
  run experiments compare --list
  for experiment in ltlm-table-8 ukf-vslm-d3-distance; do
    run "compare-$experiment" compare --experiment "$experiment" --rows 60 --json result.json --csv table.csv
  done
  run compare-degradation compare --experiment rls-degradation --json result.json --csv table.csv
  run compare-measured compare "$tracker" "${arm[@]}" --experiment ltlm-table-6 --rows 200 --json result.json
  local model="../diagnose-irb120-tracker/model.toml"
  # What one pose costs is said on stderr, in milliseconds of this run.
  run track track "$tracker" --model "$model" --date 2026-05-04T12:30:00Z -o models --json result.json --csv table.csv
  rm "$out/track/stderr.txt"
  for surface in blade dome saddle-implicit plate; do
    run "path-$surface" path "../../surfaces/$surface.toml" "${arm[@]}" -o program.mod
    run "path-$surface-nc" path "../../surfaces/$surface.toml" "${arm[@]}" -o program.mpf
  done
  local ground=(--model "$model" --allow-doubtful --tolerance 0.1)
  for emit in targets joints; do
    run "blade-$emit" compensate "../path-blade/program.mod" "${ground[@]}" --emit "$emit" \
      --surface "../../surfaces/blade.toml" -o new.mod --json result.json --csv table.csv --diff changes.diff
  done
  run blade-nc compensate "../path-blade-nc/program.mpf" "${ground[@]}" -o new.mpf --json result.json
  run blade-off deviation "../path-blade/program.mod" --model "$model" --json result.json --csv table.csv
  run blade-actual deviation "../blade-targets/new.mod" --intended "../path-blade/program.mod" --model "$model" \
    --actual "../simulate-irb120-tracker/arm.toml" --json result.json
  # Every sample program by itself, whole and in part, and all of them as one batch.
  local program name new
  for program in "$work"/programs/*; do
    name="$(basename "$program")"
    # What a task list names goes into a folder.
    case "$name" in *.pgf) new=new ;; *) new="new.${name##*.}" ;; esac
    run "each-$name" compensate "../../programs/$name" "${ground[@]}" -o "$new" --json result.json
    run "partial-$name" compensate "../../programs/$name" "${ground[@]}" --partial --circles segments -o "$new" --json result.json
  done
  run batch compensate ../../programs --each "${ground[@]}" -o new --json result.json --csv table.csv
  digest shipped.sha256
}

measured() {
  out="$work/measured"
  mkdir -p "$out"
  ln -s "$(realpath "$TRUEGRIND_DATA")" "$work/sets"
  local irb=../../sets/RobotCali.xlsx a=../../sets/ur10-landgraf/series-a.csv
  local d=../../sets/ur10-landgraf/series-d.csv ur5=../../sets/ur5-jacobi/grid.csv
  local both=(--json result.json --csv table.csv)
  run identify-robotcali identify "$irb" --robot abb-irb-120 "${both[@]}"
  run diagnose-robotcali diagnose "$irb" --robot abb-irb-120 "${both[@]}"
  run identify-hsr identify ../../sets/HSR-RobotCali.xlsx --robot hsr-jr680 --angles dh "${both[@]}"
  run identify-ur10-a identify "$a" --robot universal-robots-ur10 "${both[@]}"
  run identify-ur10-d identify "$d" --robot universal-robots-ur10 "${both[@]}"
  run diagnose-ur10-d diagnose "$d" --robot universal-robots-ur10 "${both[@]}"
  run identify-ur5 identify "$ur5" --robot universal-robots-ur5 "${both[@]}"
  run diagnose-ur5 diagnose "$ur5" --robot universal-robots-ur5 "${both[@]}"
  run compare-robotcali compare "$irb" --robot abb-irb-120 --experiment ltlm-table-6-80-20 --rows 120 "${both[@]}"
  digest measured.sha256
}

shipped
if [ -n "${TRUEGRIND_DATA:-}" ]; then
  measured
else
  echo "the measured sets: left out, since TRUEGRIND_DATA is not set"
fi
exit "$failed"
