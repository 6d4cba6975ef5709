#!/usr/bin/env bash
# Measures Lanternfish on a bare machine with a graphics card. Needs bash 4.4, coreutils, findutils and grep.
# `cargo xtask hardware` packs it.
set -u

usage() {
    cat <<'END'
run.sh [--allow-software] [--out FOLDER] [PART[=SECONDS]...]

Parts, and the most seconds that they take unless stated; without any: checks, walks and frames.
  checks   100   the checks of lanternfish doctor
  walks    180   what a frame of a walk costs, pass by pass
  frames    80   three images with their timings
  papers   540   the claims of the five papers

--allow-software   runs on a software adapter if there is no other
--out FOLDER       folder of the results; without it, hardware-results in the current folder

figures.json has the figures of all parts so far, PART.txt what a part printed; walks/report.md and papers/papers.html
are pages.

Exit status: 0 all parts passed, 1 a part failed, 2 wrong usage, 3 no graphics card found, 4 the kit cannot run here.
END
}

say() { printf '==> %s\n' "$*"; }
fail() { printf 'error: %s\n' "$2" >&2 && exit "$1"; }

allow_software=
out=hardware-results
parts=()
declare -A most=([checks]=100 [walks]=180 [frames]=80 [papers]=540)
while (($# > 0)); do
    case $1 in
        --allow-software) allow_software=1 ;;
        --out) (($# > 1)) || fail 2 '--out needs a folder' && out=$2 && shift ;;
        -h | --help) usage && exit 0 ;;
        *)
            [[ $1 =~ ^(checks|walks|frames|papers)(=([1-9][0-9]*))?$ ]] || fail 2 "unknown word '$1': see --help"
            part=${BASH_REMATCH[1]}
            parts+=("$part")
            most[$part]=${BASH_REMATCH[3]:-${most[$part]}}
            ;;
    esac
    shift
done
((${#parts[@]} > 0)) || parts=(checks walks frames)

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd) || exit 4
docs=$here/sources/docs
program=$here/lanternfish
mkdir -p -- "$out" && out=$(cd -- "$out" && pwd) || fail 4 'cannot create the folder for results'
# Results of an earlier run must not be mistaken for those of this one.
rm -rf -- "$out"/{figures.json,{checks,walks,atrium,sponza,bistro,papers}{,.txt,.json,.png}}
scratch=$(mktemp -d "${TMPDIR:-/tmp}/lanternfish.XXXXXX") || fail 4 'cannot create a temporary folder'
trap 'rm -rf -- "$scratch"' EXIT
trap 'exit 143' INT TERM

known_libraries=$(PATH=$PATH:/usr/sbin:/sbin ldconfig -p 2>/dev/null)
add_library_folder() { export LD_LIBRARY_PATH=${LD_LIBRARY_PATH:+$LD_LIBRARY_PATH:}$1; }

# The kit's libraries that this machine lacks. An installed library suits its driver better.
mkdir "$scratch/lent"
for library in "$here"/lib/*; do
    [[ ! -e $library || $known_libraries == *"${library##*/} ("* ]] || ln -s "$library" "$scratch/lent/"
done
add_library_folder "$scratch/lent"

# Paths of at most 50 files where drivers may be mounted outside the standard locations.
find_in_places() {
    timeout 10 find -L /usr/local/nvidia /opt /usr/lib /usr/lib64 -maxdepth 6 "$@" 2>/dev/null | head -n 50
}

# Lets the dynamic linker find NVIDIA's driver. It skips libraries of another word size.
if [[ $known_libraries != *libGLX_nvidia.so.0* && $known_libraries != *libEGL_nvidia.so.0* ]]; then
    while read -r folder; do
        add_library_folder "$folder"
        say "driver libraries: $folder"
    done < <(find_in_places '(' -name libGLX_nvidia.so.0 -o -name libEGL_nvidia.so.0 ')' -printf '%h\n' | sort -u)
fi

list_adapters() { timeout --kill-after=5 60 "$program" info --adapters </dev/null 2>/dev/null; }

# True if a list of adapters has one other than software.
has_hardware() { grep -E '^ +kind ' <<<"$1" | grep -qvE '^ +kind +Cpu,'; }

# Lists adapters with these manifests, joined by colons. Keeps the manifests if they provide a graphics card.
try_manifests() {
    local list
    # Loaders before 1.3.207 only support the second name.
    list=$(VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1 list_adapters) && has_hardware "$list" || return 1
    export VK_DRIVER_FILES=$1 VK_ICD_FILENAMES=$1
    adapters=$list
    say "Vulkan driver: $1"
}

# Searches for a driver that the loader does not find: a container may have the driver's library without its manifest.
look_for_driver() {
    local manifests library
    manifests=$(find_in_places -path '*vulkan*' -name '*.json' -path '*icd*' | sort | paste -s -d : -)
    [[ -n $manifests ]] && try_manifests "$manifests" && return
    for library in libGLX_nvidia.so.0 libEGL_nvidia.so.0; do
        printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "1.3.0"}}\n' "$library" \
            >"$scratch/$library.json"
        try_manifests "$scratch/$library.json" && return
    done
    return 1
}

# Reports a missing library or glibc version early.
started=$("$program" --version 2>&1) || fail 4 "the program does not start on this machine: $started"
say "$started"
adapters=$(list_adapters)
adapter=gpu
if ! has_hardware "$adapters" && ! look_for_driver; then
    adapter=cpu
    if [[ -z $allow_software || -z $adapters ]]; then
        printf '\nONLY SOFTWARE OR NO ADAPTER WAS FOUND, and nothing was run; --allow-software runs it anyway\n%s\n\n' \
            "${adapters:-none}"
        VK_LOADER_DEBUG=error,warn timeout 60 "$program" info --adapters 2>&1 >/dev/null </dev/null | tail -n 20
        ls -l /etc/vulkan/icd.d /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d 2>&1
        ls -d /dev/nvidia* /dev/dri/* /dev/dxg 2>/dev/null
        grep -E 'libvulkan|_nvidia\.so|libcuda\.so' <<<"$known_libraries"
        printf 'LD_LIBRARY_PATH=%s\n' "$LD_LIBRARY_PATH"
        exit 3
    fi >&2
fi
printf '%s\n' "$adapters"

commit=$(<"$here/commit")
failed=0
rows=

# Runs a command until the deadline of its part, and adds its exit status (124: the deadline), its time and the JSON
# that it wrote to figures.json. Arguments: name, path of the JSON, command.
measure() {
    local name=$1 report=$2 since=$SECONDS left=$((deadline - SECONDS)) status=124
    shift 2
    # timeout treats 0 as no limit.
    if ((left > 0)); then
        timeout --kill-after=5 "$left" "$@" </dev/null >"$out/$name.txt" 2>&1
        status=$?
    fi
    say "$name: exit status $status after $((SECONDS - since)) s"
    if ((status != 0)); then
        failed=1
        tail -n 15 "$out/$name.txt"
    fi
    rows+="${rows:+,}{\"name\": \"$name\", \"status\": $status, \"seconds\": $((SECONDS - since)), \"figures\": "
    if [[ -s $report ]]; then rows+=$(<"$report"); else rows+=null; fi
    rows+=$'}\n'
    printf '{"commit": "%s", "parts": [\n%s]}\n' "$commit" "$rows" >"$out/figures.json"
}

part_checks() {
    local flags=()
    # On a software adapter all checks take longer than the time limit.
    [[ $adapter == cpu ]] && flags=(--quick)
    measure checks "$out/checks.json" "$program" doctor --only checks --json "$out/checks.json" --adapter "$adapter" \
        "${flags[@]}"
}

# The benches end in time by themselves, with what there is by then.
part_walks() {
    local flags=(--size 1920x1080 --frames 24 --runs 3)
    [[ $adapter == cpu ]] && flags=(--size 96x54 --frames 4 --runs 1)
    measure walks "$out/walks/report.json" "$here/lanternfish-bench" walks "$docs/tracks/atrium.toml" "${flags[@]}" \
        --seconds $((most[walks] * 9 / 10)) --adapter "$adapter" -o "$out/walks"
}

frame() {
    local name=$1 size=1920x1080
    [[ $adapter == cpu ]] && size=320x180
    measure "$name" "$out/$name.json" "$program" render "${@:2}" --size "$size" --adapter "$adapter" --timings \
        --report "$out/$name.json" -o "$out/$name.png"
}

part_frames() {
    frame atrium demo:atrium --lights rain:1000 --seed 1
    [[ ! -d $here/shared/assets/sponza ]] || frame sponza "$docs/shots/sponza-ten.toml"
    [[ ! -d $here/shared/assets/bistro ]] || frame bistro "$docs/shots/deep-images-bistro.toml"
}

part_papers() {
    local form=--card
    [[ $adapter == cpu ]] && form=--quick
    # A part has 10 s more to write its report.
    measure papers "$out/papers/papers.json" "$here/lanternfish-bench" papers "$form" --seconds $((most[papers] - 15)) \
        --commit "$commit" --docs "$docs" --adapter "$adapter" -o "$out/papers"
}

for part in "${parts[@]}"; do
    deadline=$((SECONDS + most[$part]))
    say "$part, up to ${most[$part]} s"
    "part_$part"
done
say "done in $SECONDS s, results in $out"
ls -l -- "$out"
exit "$failed"
