#!/usr/bin/env bash
# Several moments of a model side by side. Usage: moments.sh MODEL.fil OUT.png FRAME... [-- RENDER OPTION...]
set -euo pipefail
model=$1 out=$2
shift 2
frames=()
while [[ $# != 0 && $1 != -- ]]; do frames+=("$1"); shift; done
[[ $# == 0 ]] || shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
inputs=()
for frame in "${frames[@]}"; do
    filigree render "$model" --frame "$frame" -o "$work/$frame.png" --quiet "$@"
    inputs+=(-i "$work/$frame.png")
done
ffmpeg -loglevel error -y "${inputs[@]}" -filter_complex "hstack=inputs=${#frames[@]}" "$out"
