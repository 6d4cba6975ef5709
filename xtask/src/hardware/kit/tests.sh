# Runs the tests that need an adapter, each in a separate process. Sourced by run.sh.
# shellcheck shell=bash
# shellcheck disable=SC2034,SC2154 # run.sh sets and reads variables of this file.

# Names of a test program's tests that need an adapter, one per line: the last path segment starts with gpu_.
gpu_tests() {
    # Also after the deadline: each test is then reported as not run.
    timeout --kill-after=5 30 "$1" --list --format terse </dev/null | sed -nE '/(^|::)gpu_[^:]*: test$/s/: test$//p'
    return "${PIPESTATUS[0]}"
}

# Writes a result: file, verdict, milliseconds, test.
write_result() { printf '%-12s %4d.%d  %s\n' "$2" $(($3 / 1000)) $(($3 % 1000 / 100)) "$4" >"$1"; }

# Runs one test. Its output goes to logs/NUMBER, its result to results/NUMBER. A limit below TEST_S is the part's deadline.
one_test() {
    local number=$1 program_name=$2 test=$3 limit=$4 log=$work/logs/$1 started status took word
    started=$(date +%s%3N)
    LANTERNFISH_LEFT_OUT=$log.left-out timeout --kill-after=5 "$limit" \
        "$work/tests/$program_name" --exact "$test" --nocapture >"$log" 2>&1 </dev/null
    status=$?
    took=$(($(date +%s%3N) - started))
    if ((status == 124 || (status == 137 && took >= limit * 1000))); then
        word=TIMEOUT
        ((limit < TEST_S)) && word='not run'
    elif ((status > 128)); then
        word="CRASHED($(kill -l $((status - 128))))"
    elif ((status != 0)); then
        word=FAILED
    elif grep -qs '^LEFT OUT' "$log" "$log.left-out" || grep -q 'test result: ok\. 0 passed; 0 failed; 1 ignored' "$log"; then
        word='left out'
    elif grep -q 'test result: ok\. 1 passed' "$log"; then
        word=ok
    else
        # It succeeded without running a test.
        word=FAILED
    fi
    write_result "$work/results/$number" "$word" "$took" "$program_name $test"
}

# Runs every test of every program, JOBS at a time.
run_tests() {
    local path program_name names test number=0 running limit
    for path in "$work"/tests/*; do
        program_name=${path##*/}
        if ! names=$(gpu_tests "$path" 2>"$work/list.err"); then
            number=$((number + 1))
            cp "$work/list.err" "$(printf '%s/logs/%05d' "$work" "$number")"
            write_result "$(printf '%s/results/%05d' "$work" "$number")" FAILED 0 "$program_name cannot list its tests"
            continue
        fi
        while read -r test; do
            [[ -n $test ]] || continue
            number=$((number + 1))
            while running=$(jobs -rp | wc -l) && ((running >= JOBS)); do
                wait -n
            done
            limit=$(seconds_left "$TEST_S")
            if ((limit <= 0)); then
                write_result "$(printf '%s/results/%05d' "$work" "$number")" 'not run' 0 "$program_name $test"
                continue
            fi
            one_test "$(printf '%05d' "$number")" "$program_name" "$test" "$limit" &
        done <<<"$names"
    done
    wait
}

part_tests() {
    local result line passed=0 bad=0 left_out=0 not_run=0 failures=()
    if [[ ! -d $work/tests ]]; then
        outcome='the kit holds no test programs'
        return 1
    fi
    mkdir -p "$work/logs" "$work/results"
    # Discards the shell's crash reports: the result states the crash.
    run_tests 2>/dev/null
    for result in "$work"/results/*; do
        [[ -e $result ]] || continue
        line=$(<"$result")
        printf '%s\n' "$line"
        case $line in
            'ok '*) passed=$((passed + 1)) ;;
            'left out '*) left_out=$((left_out + 1)) ;;
            'not run '*) not_run=$((not_run + 1)) ;;
            *)
                bad=$((bad + 1))
                failures+=("$result")
                ;;
        esac
    done >"$out/tests.txt"
    for result in ${failures[@]+"${failures[@]}"}; do
        line=$(<"$result")
        printf '%s\n' "$line"
        printf '\n---- %s\n' "$line" >>"$out/tests.txt"
        tail -n 15 "$work/logs/${result##*/}" >>"$out/tests.txt"
    done
    # The reasons of skipped tests.
    sed -sn '/^LEFT OUT/p' "$work"/logs/* 2>/dev/null | sort -u >"$work/reasons"
    [[ ! -s $work/reasons ]] || { echo && cat "$work/reasons"; } >>"$out/tests.txt"
    outcome="$passed passed, $bad failed, $not_run not run (deadline), $left_out left out"
    printf '\n%s\n' "$outcome" >>"$out/tests.txt"
    ((bad == 0 && passed > 0))
}
