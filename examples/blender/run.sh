#!/usr/bin/env bash
# Detail stripped, the driver simulated in Blender, the detail put back, the result played and rendered in Blender.
# Usage: examples/blender/run.sh [MESH [FOLDER]]     (a wavy cube into filigree-blender/, unless said)
# Environment: BASE, vertices of the driver (600); FRAMES (49); WIDTH and SAMPLES of the picture; FILIGREE, the program.
# Needs Debian's blender (scripts/setup installs it). No display: Blender runs in the background.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)

mesh=${1:-}
folder=${2:-filigree-blender}
frames=${FRAMES:-49}
program=${FILIGREE:-$root/build/release/bin/filigree}
[[ -x $program ]] || "$root/scripts/build" release filigree_cli
command -v blender > /dev/null || { echo "run.sh: blender is not installed; run scripts/setup" >&2; exit 1; }
mkdir -p "$folder"
if [[ -z $mesh ]]; then
    mesh=$folder/cube.ply
    "$program" make wavy-cube -o "$mesh"
fi

# Blender's cloth shares loops among threads that are too short for it: one thread is several times faster.
export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}

in_blender() {
    local log=$folder/blender.log
    blender -b --factory-startup --python-exit-code 1 -P "$@" > "$log" 2>&1 || { tail -n 20 "$log" >&2; exit 1; }
}

echo "1. the detail is taken off"
"$program" strip "$mesh" -o "$folder/model.fil" --base "${BASE:-600}"
"$program" level "$folder/model.fil" 0 -o "$folder/driver.ply"

echo "2. Blender lets the driver fall: $folder/driver.pc2"
in_blender "$here/simulate.py" -- "$folder/driver.ply" "$folder/driver.pc2" "$frames"

echo "3. the detail is put back, frame by frame"
"$program" restore "$folder/model.fil" --poses "$folder/driver.pc2" --frame-rate 24 -o "$folder/detail.pc2"

echo "4. Blender plays both caches by Mesh Cache, and renders a moment: $folder/picture.png"
"$program" restore "$folder/model.fil" --pose "$folder/driver.ply" -o "$folder/detail.ply" --quiet
BLEND=$folder/scene.blend in_blender "$here/show.py" -- "$folder/picture.png" "${FRAME:-$((frames / 4))}" \
    "$folder/driver.ply" "$folder/driver.pc2" "$folder/detail.ply" "$folder/detail.pc2"
