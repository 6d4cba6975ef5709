#!/usr/bin/env bash
# Checks Lanternfish on a minimal machine with a graphics card. Needs bash 4.4 and the base tools of Debian: coreutils,
# findutils, grep, sed, tar and gzip. `cargo xtask hardware` packs this folder.
# shellcheck source-path=SCRIPTDIR
set -u

usage() {
    cat <<'END'
run.sh [--allow-software] [--out FOLDER] [PART...]

Parts; without any: walks, ab, doctor, frames and tests, in this order.
  walks    what a frame of a walk costs         walks.md walks.json walks.tar.gz, and the same of walks-validated:
                                                with wgpu's validation of indirect calls
  ab       variants of ray traversal            ab.md ab.json
  doctor   lanternfish doctor                   doctor.txt doctor.json
  frames   three images with their timings      atrium.png sponza.png city.png frames.json
  tests    every test that needs an adapter     tests.txt
  direct   prices and errors of direct light    direct.md direct.tar.gz
  papers   the claims of the five papers        papers.html papers.json papers.tar.gz

--allow-software   runs on a software adapter if there is no other
--out FOLDER       folder of the results; without it, hardware-results in the current folder

Variables, in seconds: TOTAL_S (540, and DIRECT_S and PAPERS_S more with these parts) for everything, WALKS_S (150),
AB_S (120), DOCTOR_S (100), FRAMES_S (60), TESTS_S (300, as far as TOTAL_S allows), DIRECT_S (400), PAPERS_S (540),
TEST_S (60) for one test. Pages of walks, ab and papers, and doctor.json, are written after each of their rows or parts.
JOBS: tests at a time; without it, the number of processors, at most 8.

Exit status: 0 all parts passed, 1 a part failed, 2 wrong usage, 3 no graphics card found, 4 the kit cannot run here.
END
}

SECONDS=0
WALKS_S=${WALKS_S:-150}
AB_S=${AB_S:-120}
DOCTOR_S=${DOCTOR_S:-100}
FRAMES_S=${FRAMES_S:-60}
TESTS_S=${TESTS_S:-300}
DIRECT_S=${DIRECT_S:-400}
PAPERS_S=${PAPERS_S:-540}
TEST_S=${TEST_S:-60}
JOBS=${JOBS:-$(nproc)}
((JOBS > 8)) && JOBS=8
((JOBS < 1)) && JOBS=1

say() { printf '==> %s\n' "$*"; }
fail() {
    printf 'error: %s\n' "$2" >&2
    exit "$1"
}

allow_software=
out=hardware-results
parts=()
while (($# > 0)); do
    case $1 in
        --allow-software) allow_software=1 ;;
        --out)
            (($# > 1)) || fail 2 '--out needs a folder'
            out=$2
            shift
            ;;
        -h | --help)
            usage
            exit 0
            ;;
        walks | ab | doctor | frames | tests | direct | papers) parts+=("$1") ;;
        *)
            usage >&2
            fail 2 "unknown word '$1'"
            ;;
    esac
    shift
done
((${#parts[@]} > 0)) || parts=(walks ab doctor frames tests)
default_s=540
[[ " ${parts[*]} " == *' direct '* ]] && ((default_s += DIRECT_S))
[[ " ${parts[*]} " == *' papers '* ]] && ((default_s += PAPERS_S))
TOTAL_S=${TOTAL_S:-$default_s}

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd) || exit 4
mkdir -p -- "$out" || fail 4 'cannot create the folder for results'
out=$(cd -- "$out" && pwd) || fail 4 'cannot enter the folder for results'
# Results of an earlier run must not be mistaken for those of this one.
for name in {walks,walks-validated,direct,papers}.{md,html,json,tar.gz} ab.md ab.json ab.txt doctor.txt doctor.json tests.txt \
    frames.json atrium.png sponza.png city.png; do
    rm -f -- "$out/$name"
done
work=$(mktemp -d "${TMPDIR:-/tmp}/lanternfish.XXXXXX") || fail 4 'cannot create a temporary folder'
trap 'rm -rf -- "$work"' EXIT
trap 'exit 143' INT TERM

for name in lanternfish lanternfish-bench tests shared lib; do
    [[ -f $here/$name.tar.gz ]] || continue
    tar -xzf "$here/$name.tar.gz" --no-same-owner -C "$work" || fail 4 "cannot unpack $name.tar.gz into $work"
done
program=$work/lanternfish
[[ -x $program ]] || fail 4 "no program in $here/lanternfish.tar.gz"
export LANTERNFISH_SHARED=$work/shared RUST_BACKTRACE=0

# shellcheck source=driver.sh
. "$here/driver.sh"
# shellcheck source=tests.sh
. "$here/tests.sh"
# shellcheck source=parts.sh
. "$here/parts.sh"

lend_libraries
find_driver_libraries
# Reports a missing library or glibc version early.
started=$("$program" --version 2>&1) || fail 4 "the program does not start on this machine: $started"
say "$started"
choose_adapter || exit 3
say "adapter: $adapter, $JOBS tests at a time, up to $TOTAL_S s"

summary=()
failed=0
for part in "${parts[@]}"; do
    budget=${part^^}_S
    deadline=$((SECONDS + ${!budget}))
    ((deadline > TOTAL_S)) && deadline=$TOTAL_S
    since=$SECONDS
    if ((deadline <= SECONDS)); then
        outcome='FAILED: no time left'
        failed=1
    else
        say "$part, up to $((deadline - SECONDS)) s"
        # A part stores its summary in $outcome.
        outcome=
        if "part_$part"; then
            outcome="passed${outcome:+: $outcome}"
        else
            outcome="FAILED${outcome:+: $outcome}"
            failed=1
        fi
    fi
    summary+=("$(printf '%-7s %4d s  %s' "$part" $((SECONDS - since)) "$outcome")")
done

say "done in $SECONDS s on $adapter_names"
printf '%s\n' "${summary[@]}"
say "results in $out"
ls -l -- "$out"
exit "$failed"
