# What the scenarios share. Each scenario is a script that anybody can run after a build; it says what
# it does, ends everything it started, and exits 0 (promise kept), 1 (not), or 77 (cannot run here).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
bin=${CRANEMAP_BIN:-$root/build/release/bin}
rig=$root/tests/data/rig
work=$(mktemp -d)
pids=()
spaces=()

say() { printf '%s  %s\n' "$(date +%H:%M:%S)" "$*"; }
skip() { say "skipped: $*"; exit 77; }
fail() {
  say "FAILED: $*"
  for log in "$work"/*.log; do
    [ -f "$log" ] && { echo "--- last lines of $(basename "$log")"; tail -n 5 "$log"; }
  done
  exit 1
}

finish() {
  local code=$?
  trap - EXIT
  for pid in "${pids[@]}"; do kill -CONT "$pid" 2>/dev/null || true; kill "$pid" 2>/dev/null || true; done
  pkill -TERM -f "$work/" || true  # what those started themselves: the folder's name is this run's own
  for _ in $(seq 50); do
    local left=0
    for pid in "${pids[@]}"; do kill -0 "$pid" 2>/dev/null && left=1; done
    [ $left -eq 0 ] && break
    sleep 0.1
  done
  for pid in "${pids[@]}"; do kill -9 "$pid" 2>/dev/null || true; done
  pkill -KILL -f "$work/" || true
  for space in "${spaces[@]}"; do ip netns del "$space" 2>/dev/null || true; done
  mountpoint -q "$work/disk" && umount -l "$work/disk"
  rm -rf "$work"
  exit $code
}
trap finish EXIT
trap 'exit 130' INT TERM

# A domain that other runs on this machine hardly use.
domain=$((10 + $$ % 200))
# Likewise the site's HTTP port; a service's is that plus its number, the mapper's plus 4.
http_port=$((20000 + $$ % 20000))

# hosts N: N hosts on one network, each a network namespace; host n has the address 10.99.0.n.
hosts() {
  [ "$(id -u)" -eq 0 ] || skip "network namespaces need root"
  local name=cm$$
  spaces+=("$name-net")
  ip netns add "$name-net" 2>/dev/null || skip "this machine makes no network namespaces"
  ip -n "$name-net" link add br0 type bridge 2>/dev/null || skip "this kernel has no bridges"
  ip -n "$name-net" link set br0 up
  local n
  for n in $(seq "$1"); do
    spaces+=("$name-$n")
    ip netns add "$name-$n"
    ip -n "$name-$n" link add eth0 type veth peer name "p$n" netns "$name-net"
    ip -n "$name-$n" addr add "10.99.0.$n/24" dev eth0
    ip -n "$name-$n" link set lo up
    ip -n "$name-$n" link set eth0 up
    ip -n "$name-net" link set "p$n" master br0 up
  done
}
on() { local n=$1; shift; ip netns exec "cm$$-$n" "$@"; }
cut_cable() { ip -n "cm$$-net" link set "p$1" down; }
mend_cable() { ip -n "cm$$-net" link set "p$1" up; }
# bad_hosts LOSS DELAY JITTER DOUBLED: hosts 1 and 2 with a bad cable between them [%, ms, ms, %].
bad_hosts() {
  [ "$(id -u)" -eq 0 ] || skip "network namespaces need root"
  local name=cm$$ n
  spaces+=("$name-net" "$name-1" "$name-2")
  for n in net 1 2; do
    ip netns add "$name-$n" 2>/dev/null || skip "this machine makes no network namespaces"
  done
  start wire ip netns exec "$name-net" "$bin/cranemap-bad-wire" w1 w2 "$@"
  local wire=$last
  for _ in $(seq 50); do
    grep -q ready "$work/wire.log" && break
    running "$wire" || skip "this machine makes no TAP devices: $(cat "$work/wire.log")"
    sleep 0.1
  done
  for n in 1 2; do
    ip -n "$name-net" link set "w$n" netns "$name-$n"
    ip -n "$name-$n" link set "w$n" name eth0
    ip -n "$name-$n" addr add "10.99.0.$n/24" dev eth0
    ip -n "$name-$n" link set lo up
    ip -n "$name-$n" link set eth0 up
  done
}

# start NAME COMMAND...: in the background, its log in $work/NAME.log; $last is its process.
start() {
  local name=$1
  shift
  "$@" >> "$work/$name.log" 2>&1 &
  last=$!
  pids+=("$last")
}
# start_on HOST NAME COMMAND...
start_on() {
  local n=$1 name=$2
  shift 2
  start "$name" ip netns exec "cm$$-$n" "$@"
}
running() { kill -0 "$1" 2>/dev/null; }
# stop PID: in an orderly way; its exit code.
stop() {
  kill "$1" 2>/dev/null || true
  wait "$1"
}

# pipeline SITE [RATE]: mapper (with state), stereo, and players that go round without end.
pipeline() {
  local site=$1 rate=${2:-real}
  start mapper "$bin/cranemap-mapper" --config "$site" --calibration "$rig" --state "$work/state"
  mapper=$last
  start stereo "$bin/cranemap-stereo" --config "$site" --calibration "$rig"
  stereo=$last
  start rangefinder "$bin/cranemap-rangefinder" --config "$site" "$rig" --rate "$rate" --loop --stream 7
  rangefinder=$last
  start camera "$bin/cranemap-camera" --config "$site" "$rig" --rate "$rate" --loop --stream 7
  camera=$last
}

# of KEY FILE: a value of what 'cranemap status' printed.
of() { awk -v key="$1:" '$1 == key { print $2; exit }' "$2"; }

# status [FRAMES]: waits for a valid and complete map of $work/site.yaml, with so many frames in it; what it is like is in
# $work/status then.
status() {
  "$bin/cranemap" status --config "$work/site.yaml" --wait 20 --frames "${1:-1}" > "$work/status" ||
    fail "no map: $(cat "$work/status")"
}
