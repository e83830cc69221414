#!/usr/bin/env bash
# Trains policies on a Linux x86-64 machine with a GPU that may have no network.
set -euo pipefail

readonly PART=$((59 * 1024 * 1024))         # Bytes of a part of the packed wheels.
readonly RESULT_PART=$((14 * 1024 * 1024))  # Bytes of a part of the packed results.
readonly LEAST=20                           # Seconds below which no slice is begun.
# With PyTorch, which the machine has: its own needs, and torchvision, which is tied to one version
# of it and which nothing here imports.
readonly THEIRS=(torch torchvision)

usage() {
  cat <<'TEXT'
Trains policies on a Linux x86-64 machine with a GPU that may have no network.

gpu_study.sh pack [DIR] [--python 3.12] [--glibc 35] [--without "NAME ..."] [--dry-run]
    Here, online: put the wheels that learning needs, in the versions of uv.lock, and Draft's own
    into DIR (default dist/gpu-study), in parts under 60 MiB. Not PyTorch: that machine has it, with
    CUDA. Needs uv and pip. --glibc N takes wheels built for glibc 2.N or older. --without leaves
    out packages that the machine has too. --dry-run lists the packages, and needs no network.

gpu_study.sh install [DIR] [--into FOLDER]
    There: check and join the parts in DIR (default: where this script is), install them into FOLDER
    (default DIR/site) for the python3 that has PyTorch, and make the command DIR/draft.

gpu_study.sh run [OUT] [--minutes 8] [--designs "cheetah bear giraffe"] [--seeds "0"]
                 [--stages "base"] [--draft COMMAND] [--envs N]
    Train for at most so many minutes, and go on where the last call stopped; call again until it
    says that all is done. Runs stand in OUT (default out/gpu-study), one folder each. Videos of
    finished runs are rendered if that works. OUT/results holds what is worth taking away, in parts
    under 15 MiB.

gpu_study.sh unpack DIR INTO
    Check and join the parts in DIR and unpack them into INTO: results of another machine, to look
    at or to go on from.
TEXT
}

say() { printf '%s\n' "$*" >&2; }

fail() {
  say "error: $*"
  exit 2
}

need() {
  local name
  for name in "$@"; do
    command -v "$name" >/dev/null || fail "this needs '$name', which is not on PATH"
  done
}

# The value of an option, as VALUE: value_of OPTION [VALUE]
value_of() {
  [[ $# -ge 2 && $2 != --* ]] || fail "$1 needs a value; see --help"
  VALUE=$2
}

number() {
  [[ $2 =~ ^[0-9]+([.][0-9]+)?$ ]] || fail "$1 takes a number, not '$2'"
}

# --- Parts ---------------------------------------------------------------------------------------

# Standard input in parts: split_into DIR NAME BYTES
split_into() {
  local dir=$1 name=$2 bytes=$3
  split --bytes="$bytes" --numeric-suffixes=0 --suffix-length=3 - "$dir/$name.part-"
  (cd "$dir" && sha256sum "$name".part-* >SHA256SUMS)
}

# Parts of a folder, checked and joined, to standard output: join_from DIR
join_from() {
  local dir=$1 parts
  [[ -f $dir/SHA256SUMS ]] || fail "there is no SHA256SUMS in $dir: is it a packed folder?"
  (cd "$dir" && sha256sum --check --quiet --strict SHA256SUMS >&2) ||
    fail "parts in $dir are missing or damaged (above); copy them again"
  mapfile -t parts < <(awk '{print $2}' "$dir/SHA256SUMS" | sort)
  (cd "$dir" && cat "${parts[@]}")
}

unpack() {
  [[ $# -eq 2 ]] || fail "unpack takes DIR and INTO; see --help"
  mkdir -p "$2"
  # Not through a pipe: nothing is unpacked before all parts are checked.
  local joined
  joined=$(mktemp -p "$2" joined.XXXXXX)
  # shellcheck disable=SC2064  # The name as it is now.
  trap "rm -f '$joined'" EXIT
  join_from "$1" >"$joined"
  tar --extract --file "$joined" --directory "$2"
  rm -f "$joined"
}

# --- pack ----------------------------------------------------------------------------------------

# Pinned packages for the machine, one NAME==VERSION a line: packages PYTHON [WITHOUT...]
packages() {
  local prune=() name
  for name in "${THEIRS[@]}"; do prune+=(--prune "$name"); done
  uv export --quiet --project "$ROOT" --frozen --extra learn --no-dev --no-hashes --no-annotate --no-header \
    --no-emit-project "${prune[@]}" | python3 -c '
import sys

try:
    from packaging.requirements import Requirement
except ImportError:
    from pip._vendor.packaging.requirements import Requirement

machine = {
    "implementation_name": "cpython",
    "os_name": "posix",
    "platform_machine": "x86_64",
    "platform_python_implementation": "CPython",
    "platform_system": "Linux",
    "python_full_version": sys.argv[1] + ".0",
    "python_version": sys.argv[1],
    "sys_platform": "linux",
}
for line in sys.stdin:
    one = Requirement(line.strip())
    theirs = one.name.startswith(("nvidia-", "cuda-")) or one.name in ("triton", *sys.argv[2:])
    if not theirs and (one.marker is None or one.marker.evaluate(machine)):
        print(f"{one.name}{one.specifier}")
' "$@"
}

# Download wheels for the machine: download INTO PYTHON GLIBC < packages
download() {
  local into=$1 python=$2 glibc=$3 platforms=() n
  # pip matches these tags exactly: each has to be named.
  for ((n = glibc; n >= 5; n--)); do platforms+=(--platform "manylinux_2_${n}_x86_64"); done
  for n in manylinux2014 manylinux2010 manylinux1 linux; do platforms+=(--platform "${n}_x86_64"); done
  python3 -m pip download --quiet --no-deps --only-binary=:all: --python-version "$python" \
    --implementation cp "${platforms[@]}" --dest "$into" --requirement /dev/stdin
}

pack() {
  local dir='' python=3.12 glibc=35 without=() dry='' work list count
  while [[ $# -gt 0 ]]; do
    case $1 in
    --python) value_of "$@" && python=$VALUE && shift ;;
    --glibc) value_of "$@" && glibc=$VALUE && shift ;;
    --without) value_of "$@" && read -ra without <<<"$VALUE" && shift ;;
    --dry-run) dry=yes ;;
    -*) fail "pack has no option $1; see --help" ;;
    *) [[ -z $dir ]] || fail "pack takes one folder, not '$dir' and '$1'" && dir=$1 ;;
    esac
    shift
  done
  [[ $python =~ ^3\.[0-9]+$ ]] || fail "--python takes a version such as 3.12, not '$python'"
  [[ $glibc =~ ^[0-9]+$ ]] || fail "--glibc takes N of glibc 2.N, such as 35, not '$glibc'"
  need uv python3
  list=$(packages "$python" "${without[@]}")
  count=$(wc -l <<<"$list")
  if [[ -n $dry ]]; then
    printf '%s\n' "$list"
    say "$count packages for Python $python, and Draft itself; without ${THEIRS[*]} and CUDA"
    return
  fi
  dir=${dir:-dist/gpu-study}
  mkdir -p "$dir"
  work=$(mktemp -d -p "$dir" work.XXXXXX)
  # shellcheck disable=SC2064  # The name as it is now.
  trap "rm -rf '$work'" EXIT
  mkdir "$work/wheels" "$work/parts"
  say "downloading $count packages for Python $python"
  download "$work/wheels" "$python" "$glibc" <<<"$list"
  python3 -m pip wheel --quiet --no-deps --wheel-dir "$work/wheels" "$ROOT"
  # Wheels are compressed already.
  tar --create --directory "$work" wheels | split_into "$work/parts" wheels.tar "$PART"
  {
    printf 'Draft with learning for Linux x86-64, Python %s, glibc 2.%s or newer.\n' "$python" "$glibc"
    printf 'It needs PyTorch with CUDA there; tested with torch %s.\n' "$(locked torch)"
    printf '\nThere: bash gpu_study.sh install\n\n'
    (cd "$work/wheels" && du --apparent-size --bytes -- *.whl)
  } >"$work/parts/manifest.txt"
  cp "$SELF" "$work/parts/gpu_study.sh"
  rm -f "$dir"/wheels.tar.part-*
  mv "$work"/parts/* "$dir"
  say "$(find "$dir" -name 'wheels.tar.part-*' | wc -l) parts in $dir," \
    "$(du --apparent-size --total --block-size=1M "$dir"/wheels.tar.part-* | tail -n 1 | cut -f 1) MiB"
  say "copy $dir there, then: bash gpu_study.sh install"
}

# Version of a package in uv.lock: locked NAME
locked() {
  awk -v name="name = \"$1\"" '$0 == name {getline; gsub(/version = |"/, ""); print; exit}' "$ROOT/uv.lock"
}

# --- install -------------------------------------------------------------------------------------

install() {
  local dir='' into='' work
  while [[ $# -gt 0 ]]; do
    case $1 in
    --into) value_of "$@" && into=$VALUE && shift ;;
    -*) fail "install has no option $1; see --help" ;;
    *) [[ -z $dir ]] || fail "install takes one folder, not '$dir' and '$1'" && dir=$1 ;;
    esac
    shift
  done
  dir=$(cd "${dir:-$(dirname "$SELF")}" && pwd)
  into=${into:-$dir/site}
  need python3 sha256sum tar
  python3 -c 'import torch' 2>/dev/null ||
    fail "python3 ($(command -v python3)) has no PyTorch: put the python3 that has it first on PATH"
  mkdir -p "$into"
  into=$(cd "$into" && pwd)
  work=$(mktemp -d -p "$dir" wheels.XXXXXX)
  # shellcheck disable=SC2064  # The name as it is now.
  trap "rm -rf '$work'" EXIT
  say "checking and joining the parts"
  (unpack "$dir" "$work") || exit
  say "installing into $into"
  PIP_DISABLE_PIP_VERSION_CHECK=1 python3 -m pip install --quiet --no-index --no-deps --no-compile --upgrade --target "$into" \
    "$work"/wheels/*.whl
  cat >"$dir/draft" <<TEXT
#!/bin/sh
PYTHONPATH="$into\${PYTHONPATH:+:\$PYTHONPATH}" exec "$(command -v python3)" -m draft "\$@"
TEXT
  chmod +x "$dir/draft"
  PYTHONPATH=$into python3 -c '
import draft, mjlab, mujoco, mujoco_warp, rsl_rl, tensorboard, torch, warp
import draft.learn.lab.tasks

found = torch.cuda.is_available()
print(f"torch {torch.__version__}, mujoco {mujoco.__version__}, warp {warp.__version__}:", end=" ")
print(torch.cuda.get_device_name() if found else "no CUDA device is seen")
' || fail "what is installed does not import (above); is PyTorch there as old as the manifest's?"
  say "ready: bash gpu_study.sh run OUT --draft $dir/draft"
}

# --- run -----------------------------------------------------------------------------------------

run() {
  local out='' minutes=8 designs='cheetah bear giraffe' seeds=0 stages=base
  local stage seed design
  DRAFT=draft ENVS=() OPEN=0 FAILED=0
  while [[ $# -gt 0 ]]; do
    case $1 in
    --minutes) value_of "$@" && minutes=$VALUE && shift ;;
    --designs) value_of "$@" && designs=$VALUE && shift ;;
    --seeds) value_of "$@" && seeds=$VALUE && shift ;;
    --stages) value_of "$@" && stages=$VALUE && shift ;;
    --draft) value_of "$@" && DRAFT=$VALUE && shift ;;
    --envs) value_of "$@" && ENVS=(--envs "$VALUE") && shift ;;
    -*) fail "run has no option $1; see --help" ;;
    *) [[ -z $out ]] || fail "run takes one folder, not '$out' and '$1'" && out=$1 ;;
    esac
    shift
  done
  number --minutes "$minutes"
  for seed in $seeds; do number --seeds "$seed"; done
  for stage in $stages; do
    [[ $stage =~ ^(base|velocity|terrain|push)$ ]] ||
      fail "there is no stage '$stage'; stages: base, velocity, terrain, push"
  done
  need "$DRAFT" sha256sum tar
  out=${out:-out/gpu-study}
  mkdir -p "$out"
  END=$(awk -v now="$(now)" -v minutes="$minutes" 'BEGIN {printf "%d", now + 60 * minutes}')
  for stage in $stages; do
    for seed in $seeds; do
      for design in $designs; do slice "$out" "$design" "$stage" "$seed"; done
    done
  done
  results "$out"
  [[ $FAILED -eq 0 ]] || say "$FAILED failed: see their logs in $out"
  if [[ $OPEN -eq 0 ]]; then say "all is done"; else say "$OPEN to go on with: call again"; fi
  [[ $FAILED -eq 0 ]]
}

now() { date +%s; }

# One run goes on for the time that is left: slice OUT DESIGN STAGE SEED
slice() {
  local out=$1 design=$2 stage=$3 seed=$4 name
  name=${design//[^A-Za-z0-9_.-]/_}
  if [[ $stage != base && ! -f $out/$name-base-$seed.done ]]; then
    say "$name-$stage-$seed waits for its base policy"
    OPEN=$((OPEN + 1))
    return
  fi
  name=$name-$stage-$seed
  if [[ ! -f $out/$name.done ]]; then
    train "$out" "$name" "$design" --stage "$stage" --seed "$seed" "${ENVS[@]}"
  fi
  if [[ -f $out/$name.done && ! -f $out/$name.played && $((END - $(now))) -ge $LEAST ]]; then
    say "$name: rendering a video"
    MUJOCO_GL=${MUJOCO_GL:-egl} "$DRAFT" play "$out/$name" --video >>"$out/$name.log" 2>&1 ||
      say "$name: no video, see $out/$name.log"
    touch "$out/$name.played"
  fi
}

# A slice of training: train OUT NAME ARGUMENT...
train() {
  local out=$1 name=$2 left
  shift 2
  left=$((END - $(now)))
  if [[ $left -lt $LEAST ]]; then
    OPEN=$((OPEN + 1))
    return
  fi
  say "$name: training for at most $left s"
  if ! "$DRAFT" train "$@" --out "$out/$name" \
    --minutes "$(awk -v s="$left" 'BEGIN {printf "%.2f", s / 60}')" 2>&1 |
    tee "$out/$name.slice"; then
    say "$name: failed"
    FAILED=$((FAILED + 1))
  elif grep --quiet --extended-regexp '^done: |iterations are done$' "$out/$name.slice"; then
    touch "$out/$name.done"
    say "$name: done"
  else
    OPEN=$((OPEN + 1))
  fi
  cat "$out/$name.slice" >>"$out/$name.log"
  rm "$out/$name.slice"
}

# Everything but older checkpoints, in parts: results OUT
results() {
  local out=$1 run older file old=()
  for run in "$out"/*/; do
    [[ -d $run ]] || continue
    mapfile -t older < <(find "$run" -maxdepth 1 -name 'model_*.pt' -printf '%f\n' |
      sort --version-sort | head --lines=-1)
    for file in "${older[@]}"; do old+=("--exclude=./$(basename "$run")/$file"); done
  done
  rm -rf "$out/results"
  mkdir "$out/results"
  tar --create --gzip --directory "$out" --exclude=./results "${old[@]}" . |
    split_into "$out/results" results.tar.gz "$RESULT_PART"
}

main() {
  SELF=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/$(basename "${BASH_SOURCE[0]}")
  ROOT=$(dirname "$(dirname "$SELF")")
  case ${1:-} in
  pack | install | run | unpack) "$@" ;;
  -h | --help) usage ;;
  '') usage >&2 && exit 2 ;;
  *) fail "there is no '$1'; use pack, install, run or unpack, or --help" ;;
  esac
}

main "$@"
