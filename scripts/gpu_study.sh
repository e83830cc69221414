#!/usr/bin/env bash
# Runs a study on a Linux x86-64 machine with a GPU that may have no network.
set -euo pipefail

readonly PART=$((59 * 1024 * 1024))         # Bytes of a part of the packed wheels.
readonly RESULT_PART=$((14 * 1024 * 1024))  # Bytes of a part of the packed results.
readonly LEAST=20                           # Seconds below which no video is begun.
readonly STUDY=published_quadrupeds.yaml        # What is run where no study is named.
# With PyTorch, which the machine has: its own needs, and torchvision, which is tied to one version
# of it and which nothing here imports.
readonly THEIRS=(torch torchvision)

usage() {
  cat <<'TEXT'
Runs a study on a Linux x86-64 machine with a GPU that may have no network.

gpu_study.sh pack [DIR] [--python 3.12] [--glibc 35] [--without "NAME ..."] [--study FILE]
                  [--dry-run]
    Here, online: put the wheels that a study needs, in the versions of uv.lock, and Draft's own
    into DIR (default dist/gpu-study), in parts under 60 MiB, and the study files of examples/.
    Those are the wheels of Draft's extras learn and figures: the report needs matplotlib and
    pyarrow, a study with a family scipy. Not PyTorch: that machine has it, with CUDA; manifest.txt
    says which version it needs. Needs uv and pip. --glibc N takes wheels built for glibc 2.N or
    older. --without leaves out packages that the machine has too. --study adds a study of your own;
    design files that it names have to be copied too. --dry-run lists the packages, and needs no
    network.

gpu_study.sh install [DIR] [--into FOLDER]
    There: check and join the parts in DIR (default: where this script is), check that PyTorch is
    new enough, install them into FOLDER (default DIR/site) for the python3 that has PyTorch, and
    make the command DIR/draft.

gpu_study.sh run [FILE] [OUT] [--minutes 8] [--toy] [--draft COMMAND] [--device D] [-- OPTION ...]
    Run the study FILE (default published_quadrupeds.yaml, as it was packed) by 'draft study' for at
    most so many minutes, and go on where the last call stopped; call again until the last line says
    that all is done. It stands in OUT (default out/FILE). In what is left of the time, videos of
    the policies are rendered if that works. OUT/results then holds what is worth taking away, in
    parts under 15 MiB; packing them is not within the minutes. Options after -- are for
    'draft study'.

gpu_study.sh unpack DIR INTO
    Check and join the parts in DIR and unpack them into INTO: the study of another machine, to
    report on: draft study report INTO; or to go on with: draft study FILE --out INTO.
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

make() {
  mkdir -p "$1" 2>/dev/null || fail "cannot make the folder '$1'"
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
  make "$2"
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

# Python that reads what packages need.
readonly REQUIREMENT='
try:
    from packaging.requirements import Requirement
except ImportError:
    from pip._vendor.packaging.requirements import Requirement
'

# Pinned packages for the machine, one NAME==VERSION a line: packages PYTHON [WITHOUT...]
packages() {
  local prune=() name
  for name in "${THEIRS[@]}"; do prune+=(--prune "$name"); done
  uv export --quiet --project "$ROOT" --frozen --extra learn --extra figures --no-dev --no-hashes \
    --no-annotate --no-header --no-emit-project "${prune[@]}" | python3 -c "$REQUIREMENT"'
import sys

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

# What wheels need of PyTorch, the newest first, each as SPECIFIER, by NAME VERSION; with a version
# only what it does not meet: torch_needs WHEELS [VERSION]
torch_needs() {
  python3 -c "$REQUIREMENT"'
import sys
from email.parser import Parser
from pathlib import Path
from zipfile import ZipFile

found = []
for wheel in Path(sys.argv[1]).glob("*.whl"):
    with ZipFile(wheel) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        told = Parser().parsestr(archive.read(name).decode())
    for line in told.get_all("Requires-Dist", []):
        one = Requirement(line)
        if one.name != "torch" or (one.marker and not one.marker.evaluate({"extra": ""})):
            continue
        if not (sys.argv[2:] and one.specifier.contains(sys.argv[2], prereleases=True)):
            numbers = [int(n) for n in str(one.specifier).strip("<>=~! ").split(".") if n.isdigit()]
            name, version = told["Name"], told["Version"]
            found.append((numbers, f"{one.specifier}, by {name} {version}"))
for _, words in sorted(found, reverse=True):
    print(words)
' "$@"
}

# Study files to pack, one a line: studies [FILE]
studies() {
  local name=${1:+$(basename "$1")}
  if [[ -n $name ]]; then
    [[ -f $1 && -r $1 ]] || fail "there is no study '$1'"
    [[ $name == *.yaml || $name == *.yml ]] || fail "'$1' does not end in .yaml, as studies do"
    [[ ! -f $ROOT/examples/$name || $1 -ef $ROOT/examples/$name ]] ||
      fail "examples/ has a $name too: give yours another name"
    [[ -f $ROOT/examples/$name ]] || printf '%s\n' "$1"
  fi
  grep --files-with-matches '^designs:' "$ROOT"/examples/*.yaml
}

pack() {
  local dir='' python=3.12 glibc=35 without=() dry='' own='' work list count files
  while [[ $# -gt 0 ]]; do
    case $1 in
    --python) value_of "$@" && python=$VALUE && shift ;;
    --glibc) value_of "$@" && glibc=$VALUE && shift ;;
    --without) value_of "$@" && read -ra without <<<"$VALUE" && shift ;;
    --study) value_of "$@" && own=$VALUE && shift ;;
    --dry-run) dry=yes ;;
    -*) fail "pack has no option $1; see --help" ;;
    *) [[ -z $dir ]] || fail "pack takes one folder, not '$dir' and '$1'" && dir=$1 ;;
    esac
    shift
  done
  [[ $python =~ ^3\.[0-9]+$ ]] || fail "--python takes a version such as 3.12, not '$python'"
  [[ $glibc =~ ^[0-9]+$ ]] || fail "--glibc takes N of glibc 2.N, such as 35, not '$glibc'"
  [[ -f $ROOT/uv.lock ]] || fail "pack works in Draft's repository, which has uv.lock"
  files=$(studies "$own") || exit
  mapfile -t files <<<"$files"
  need uv python3
  list=$(packages "$python" "${without[@]}")
  count=$(wc -l <<<"$list")
  if [[ -n $dry ]]; then
    printf '%s\n' "$list"
    say "$count packages for Python $python, and Draft itself; without ${THEIRS[*]} and CUDA"
    return
  fi
  dir=${dir:-dist/gpu-study}
  make "$dir"
  work=$(mktemp -d -p "$dir" work.XXXXXX)
  # shellcheck disable=SC2064  # The name as it is now.
  trap "rm -rf '$work'" EXIT
  mkdir "$work/wheels" "$work/parts"
  say "downloading $count packages for Python $python"
  download "$work/wheels" "$python" "$glibc" <<<"$list"
  python3 -m pip wheel --quiet --no-deps --wheel-dir "$work/wheels" "$ROOT"
  # Wheels are compressed already.
  tar --create --directory "$work" wheels | split_into "$work/parts" wheels.tar "$PART"
  cp -- "${files[@]}" "$work/parts"
  manifest "$work" "$python" "$glibc" >"$work/manifest.txt"
  mv "$work/manifest.txt" "$work/parts"
  cp "$SELF" "$work/parts/gpu_study.sh"
  rm -f "$dir"/wheels.tar.part-*
  mv "$work"/parts/* "$dir"
  say "$(find "$dir" -name 'wheels.tar.part-*' | wc -l) parts in $dir," \
    "$(du --apparent-size --total --block-size=1M "$dir"/wheels.tar.part-* | tail -n 1 | cut -f 1) MiB"
  say "copy $dir there, then: bash gpu_study.sh install"
}

# What is packed: manifest WORK PYTHON GLIBC
manifest() {
  printf 'Draft with learning for Linux x86-64, Python %s, glibc 2.%s or newer.\n' "$2" "$3"
  printf 'It needs PyTorch with CUDA there: torch%s.\n' "$(torch_needs "$1/wheels" | head -n 1)"
  printf 'Locked, and tested with: torch %s.\n' "$(locked torch)"
  printf '\nThere: bash gpu_study.sh install\n\nStudies:\n'
  (cd "$1/parts" && du --apparent-size --bytes -- *.y*ml)
  printf '\nWheels:\n'
  (cd "$1/wheels" && du --apparent-size --bytes -- *.whl)
}

# Version of a package in uv.lock: locked NAME
locked() {
  awk -v name="name = \"$1\"" '$0 == name {getline; gsub(/version = |"/, ""); print; exit}' "$ROOT/uv.lock"
}

# --- install -------------------------------------------------------------------------------------

install() {
  local dir='' into='' work torch lacks
  while [[ $# -gt 0 ]]; do
    case $1 in
    --into) value_of "$@" && into=$VALUE && shift ;;
    -*) fail "install has no option $1; see --help" ;;
    *) [[ -z $dir ]] || fail "install takes one folder, not '$dir' and '$1'" && dir=$1 ;;
    esac
    shift
  done
  dir=${dir:-$(dirname "$SELF")}
  [[ -d $dir ]] || fail "there is no folder '$dir'"
  dir=$(cd "$dir" && pwd)
  into=${into:-$dir/site}
  need python3 sha256sum tar
  torch=$(python3 -c 'import torch; print(torch.__version__)' 2>/dev/null) ||
    fail "python3 ($(command -v python3)) has no PyTorch: put the python3 that has it first on PATH"
  work=$(mktemp -d -p "$dir" wheels.XXXXXX)
  # shellcheck disable=SC2064  # The name as it is now.
  trap "rm -rf '$work'" EXIT
  say "checking and joining the parts"
  (unpack "$dir" "$work") || exit
  lacks=$(torch_needs "$work/wheels" "$torch" | head -n 1)
  [[ -z $lacks ]] || fail "PyTorch there is $torch, and this needs torch$lacks: install that first"
  make "$into"
  into=$(cd "$into" && pwd)
  say "installing into $into"
  PIP_DISABLE_PIP_VERSION_CHECK=1 python3 -m pip install --quiet --no-index --no-deps --no-compile \
    --upgrade --target "$into" "$work"/wheels/*.whl
  cat >"$dir/draft" <<TEXT
#!/bin/sh
PYTHONPATH="$into\${PYTHONPATH:+:\$PYTHONPATH}" exec "$(command -v python3)" -m draft "\$@"
TEXT
  chmod +x "$dir/draft"
  PYTHONPATH=$into python3 -c '
import draft, matplotlib, mjlab, mujoco, mujoco_warp, pyarrow, rsl_rl, tensorboard, torch, warp
import draft.learn.lab.env_cfg

found = torch.cuda.is_available()
print(f"torch {torch.__version__}, mujoco {mujoco.__version__}, warp {warp.__version__}:", end=" ")
print(torch.cuda.get_device_name() if found else "no CUDA device is seen")
' || fail "what is installed does not import (above); does the machine have what was left out?"
  say "ready: bash gpu_study.sh run --draft $dir/draft"
}

# --- run -----------------------------------------------------------------------------------------

run() {
  local file='' out='' minutes=8 toy=() more=() status=0 said
  DRAFT=draft DEVICE=()
  while [[ $# -gt 0 ]]; do
    case $1 in
    --minutes) value_of "$@" && minutes=$VALUE && shift ;;
    --toy) toy=(--toy) ;;
    --draft) value_of "$@" && DRAFT=$VALUE && shift ;;
    --device) value_of "$@" && DEVICE=(--device "$VALUE") && shift ;;
    --) shift && more=("$@") && break ;;
    -*) fail "run has no option $1; see --help; options for 'draft study' come after --" ;;
    *)
      [[ -z $out ]] || fail "run takes a study and a folder, and '$1' besides"
      if [[ -z $file ]]; then file=$1; else out=$1; fi
      ;;
    esac
    shift
  done
  number --minutes "$minutes"
  check_more "${more[@]}"
  file=${file:-$(shipped)}
  [[ -f $file ]] || fail "there is no study '$file'; name its file, such as $STUDY"
  need "$DRAFT" sha256sum tar timeout
  out=${out:-out/$(basename "${file%.*}")${toy:+-toy}}
  END=$(awk -v now="$(date +%s)" -v minutes="$minutes" 'BEGIN {printf "%d", now + 60 * minutes}')
  said=$(mktemp)
  # shellcheck disable=SC2064  # The name as it is now.
  trap "rm -f '$said'" EXIT
  "$DRAFT" study "$file" --out "$out" --minutes "$minutes" "${toy[@]}" "${DEVICE[@]}" \
    "${more[@]}" | tee "$said" || status=${PIPESTATUS[0]}
  JOBS=$(grep --extended-regexp '^[0-9]+ of [0-9]+ jobs are done' "$said" | tail -n 1) || {
    say "draft study did not come to its end (exit code $status); results are as they were"
    exit $((status ? status : 2))
  }
  videos "$out"
  results "$out"
  conclude "$out"
  return "$status"
}

# Options for 'draft study' that would not leave a study, or that are given here.
check_more() {
  local one
  for one in "$@"; do
    case ${one%%=*} in
    --dry-run | --json | -h | --help) fail "'draft study $one' itself does that, not run" ;;
    --out | --minutes | --toy | --device) fail "$one comes before --, as an option of run" ;;
    esac
  done
}

# The study that is run where none is named: as it was packed, or the repository's.
shipped() {
  local packed
  packed=$(dirname "$SELF")/$STUDY
  if [[ -f $packed ]]; then printf '%s' "$packed"; else printf '%s' "$ROOT/examples/$STUDY"; fi
}

# Videos of runs by their last checkpoints, each tried once, while there is time: videos OUT
videos() {
  local run last log left status
  AHEAD=0
  for run in "$1"/runs/*/; do
    run=${run%/}
    last=$(find "$run" -maxdepth 1 -name 'model_*.pt' -printf '%f\n' 2>/dev/null |
      sort --version-sort | tail -n 1) || true
    log=$run/${last%.pt}.play.log
    [[ -n $last && ! -f $log ]] || continue
    left=$((END - $(date +%s)))
    status=124
    if [[ $left -ge $LEAST ]]; then
      say "$(basename "$run"): rendering a video"
      status=0
      MUJOCO_GL=${MUJOCO_GL:-egl} timeout --kill-after=5 "$left" \
        "$DRAFT" play "$run" "${DEVICE[@]}" >"$log.new" 2>&1 || status=$?
    fi
    if [[ $status -eq 124 || ($status -eq 137 && $(date +%s) -ge $END) ]]; then
      rm -f "$log.new" "$run"/.play.*  # The time was up before it was whole.
      AHEAD=$((AHEAD + 1))
    else
      mv "$log.new" "$log"
      [[ $status -eq 0 ]] || say "$(basename "$run"): no video, see $log"
    fi
  done
}

# Everything but older checkpoints, in parts: results OUT
results() {
  local out=$1
  rm -rf "$out/results.new"
  mkdir "$out/results.new"
  tar --create --gzip --directory "$out" --exclude=.lock --anchored --no-wildcards \
    --exclude=./results --exclude=./results.new --exclude-from=<(older "$out") . |
    split_into "$out/results.new" results.tar.gz "$RESULT_PART"
  rm -rf "$out/results"
  mv "$out/results.new" "$out/results"
}

# Checkpoints that are not the last of their run, as ./PATH: older OUT
older() {
  (cd "$1" && find . -name 'model_*.pt') | awk '{
    run = $0
    sub("/[^/]*$", "", run)
    number = substr($0, length(run) + 8) + 0
    if (!(run in last) || number > most[run]) {
      if (run in last) print last[run]
      last[run] = $0
      most[run] = number
    } else print
  }'
}

# Say whether to call again, by what 'draft study' said of its jobs: conclude OUT
conclude() {
  local done=0 all=0 failed=0 skipped=0 open
  [[ $JOBS =~ ^([0-9]+)\ of\ ([0-9]+) ]] && done=${BASH_REMATCH[1]} all=${BASH_REMATCH[2]}
  [[ $JOBS =~ ([0-9]+)\ failed ]] && failed=${BASH_REMATCH[1]}
  [[ $JOBS =~ ([0-9]+)\ skipped ]] && skipped=${BASH_REMATCH[1]}
  open=$((all - done - failed - skipped))
  # The report is not done before all else is: where jobs failed it is of the others.
  if [[ $failed -gt 0 && $open -le 1 ]]; then
    say "$failed failed, $skipped rest on them, all else is done: see $1/logs and mend it;" \
      "the same call tries them again"
  elif [[ $failed -gt 0 ]]; then
    say "$failed failed, see $1/logs; $open of $all jobs to go on with: call again"
  elif [[ $open -gt 0 ]]; then
    say "$open of $all jobs to go on with: call again"
  elif [[ $AHEAD -gt 0 ]]; then
    say "all is done but videos, $AHEAD of them: call again"
  else
    say "all is done"
  fi
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
