# The parts that call the command line: walks, ab, doctor, frames, direct, papers. Sourced by run.sh.
# shellcheck shell=bash
# shellcheck disable=SC2034,SC2154 # run.sh sets and reads variables of this file.

# Seconds to the deadline of the current part, at most $1.
seconds_left() {
    local left=$((deadline - SECONDS))
    echo $((left < $1 ? left : $1))
}

# Runs a command until the deadline of the current part; status 124 after that.
before_deadline() {
    local left
    left=$(seconds_left "$TOTAL_S")
    # timeout treats 0 as no limit.
    ((left > 0)) || return 124
    timeout --kill-after=5 "$left" "$@" </dev/null
}

# The description of an exit status.
status_words() {
    case $1 in
        124) echo 'deadline' ;;
        137) echo 'killed (deadline or memory)' ;;
        *) echo "exit status $1" ;;
    esac
}

# Joins words with commas.
joined() {
    (($# == 0)) || printf '%s' "$1"
    (($# < 2)) || printf ', %s' "${@:2}"
}

part_doctor() {
    local flags=() status
    # On a software adapter all checks take longer than the time limit.
    [[ $adapter == cpu ]] && flags+=(--quick)
    [[ -s $here/commit ]] && flags+=(--commit "$(<"$here/commit")")
    before_deadline "$program" doctor --adapter "$adapter" ${flags[@]+"${flags[@]}"} --json "$out/doctor.json" \
        >"$out/doctor.txt" 2>&1
    status=$?
    case $status in
        0) return 0 ;;
        1) outcome='a check failed, see doctor.txt' ;;
        *)
            outcome=$(status_words "$status")
            # Prints the results so far.
            timeout 10 "$program" doctor --read "$out/doctor.json" >>"$out/doctor.txt" 2>&1 </dev/null
            ;;
    esac
    tail -n 15 "$out/doctor.txt"
    return 1
}

# Renders one image into NAME.png and adds its report to frames.json. Arguments: name, scene and further flags.
frame() {
    local name=$1 scene=$2 log=$work/$1.log report=$work/$1.json status
    shift 2
    if [[ $scene != demo:* && ! -f $scene ]]; then
        frame_words+=("$name left out")
        return
    fi
    before_deadline "$program" render "$scene" "$@" --size "$size" --adapter "$adapter" --timings --report "$report" \
        -o "$out/$name.png" >"$log" 2>&1
    status=$?
    if ((status != 0)); then
        frame_words+=("$name $(status_words "$status")")
        frames_failed=1
        tail -n 15 "$log"
    fi
    {
        printf '%s{"frame": "%s", "status": %d, "report": ' "$separator" "$name" "$status"
        if [[ -s $report ]]; then cat "$report"; else echo null; fi
        printf '}'
    } >>"$out/frames.json"
    separator=$',\n'
}

part_frames() {
    local size=1920x1080 separator='' frames_failed=0 frame_words=()
    [[ $adapter == cpu ]] && size=320x180
    printf '[\n' >"$out/frames.json"
    frame atrium demo:atrium --lights rain:1000 --seed 1
    frame sponza "$work/shared/shots/sponza-ten.toml"
    frame city "$work/shared/assets/candela-city/candela_city.glb"
    printf '\n]\n' >>"$out/frames.json"
    outcome=$(joined ${frame_words[@]+"${frame_words[@]}"})
    ((frames_failed == 0))
}

# Runs a benchmark. Its page goes to the results, and all that it wrote to NAME.tar.gz. Arguments: name, file of the page, its
# name among the results, words of the command line.
bench() {
    local name=$1 page=$2 result=$3 status
    shift 3
    mkdir -p "$work/$name"
    before_deadline "$work/lanternfish-bench" "$@" --adapter "$adapter" -o "$work/$name" >"$work/$name/$name.txt" 2>&1
    status=$?
    if ((status != 0)); then
        outcome=$(status_words "$status")
        tail -n 5 "$work/$name/$name.txt"
    fi
    # What there is by the deadline.
    [[ -f $work/$name/$page ]] && cp -- "$work/$name/$page" "$out/$result"
    [[ -f $work/$name/report.json ]] && cp -- "$work/$name/report.json" "$out/$name.json"
    if ! tar -czf "$out/$name.tar.gz" -C "$work" "$name"; then
        outcome=$(joined ${outcome:+"$outcome"} 'tar failed')
        status=1
    fi
    return "$((status != 0))"
}

# What a frame of a walk costs, without and with wgpu's validation of indirect calls.
part_walks() {
    local track=$work/shared/tracks/atrium.toml flags=(--size 1920x1080 --frames 24 --runs 3) words failed=0
    [[ $adapter == cpu ]] && flags=(--size 96x54 --frames 4 --runs 1)
    # The second run needs a quarter of the time.
    flags+=(--seconds "$(seconds_left $((WALKS_S * 3 / 4)))")
    bench walks report.md walks.md walks "$track" "${flags[@]}" || failed=1
    words=$outcome outcome=
    WGPU_VALIDATION_INDIRECT_CALL=1 bench walks-validated report.md walks-validated.md walks "$track" "${flags[@]}" \
        --only 'draft, direct all' || failed=1
    outcome=$(joined ${words:+"$words"} ${outcome:+"$outcome"})
    return "$failed"
}

# Variants of ray traversal.
part_ab() {
    local status commit=()
    [[ -s $here/commit ]] && commit=(--commit "$(<"$here/commit")")
    before_deadline "$program" doctor --only ab --adapter "$adapter" --seconds "$(seconds_left $((AB_S * 9 / 10)))" \
        ${commit[@]+"${commit[@]}"} --json "$out/ab.json" >"$out/ab.txt" 2>&1
    status=$?
    # Also of a run that did not end.
    [[ -f $out/ab.json ]] && timeout 10 "$program" doctor --read "$out/ab.json" --page >"$out/ab.md" 2>>"$out/ab.txt" </dev/null
    ((status == 0)) && return
    outcome=$(status_words "$status")
    tail -n 15 "$out/ab.txt"
    return 1
}

# Prices, errors and motion of direct light.
part_direct() {
    local flags=(--size 1920x1080 --frames 60)
    [[ $adapter == cpu ]] && flags=(--size 160x90 --frames 4 --runs 1 --counts 10,1000)
    bench direct report.md direct.md direct demo:atrium --lights rain:1000 "${flags[@]}"
}

# The page of the five papers.
part_papers() {
    local form=--card commit=() failed=0
    [[ $adapter == cpu ]] && form=--quick
    [[ -s $here/commit ]] && commit=(--commit "$(<"$here/commit")")
    # A part has 10 s more to write its report.
    bench papers papers.html papers.html papers "$form" --seconds "$(($(seconds_left "$PAPERS_S") - 15))" \
        ${commit[@]+"${commit[@]}"} --docs "$work/shared" || failed=1
    [[ -f $work/papers/papers.json ]] && cp -- "$work/papers/papers.json" "$out/papers.json"
    return "$failed"
}
