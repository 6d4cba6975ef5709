use super::*;

#[test]
fn a_kit_that_is_too_large_is_an_error_with_its_sizes() {
    let files = |size| [("lanternfish.tar.gz".to_owned(), 1 << 20), ("tests.tar.gz".to_owned(), size)];
    let fits = table(&files(MOST_BYTES - (1 << 20))).expect("it is as large as it may be");
    assert_eq!(fits, "    1.00 MiB  lanternfish.tar.gz\n   59.00 MiB  tests.tar.gz\n   60.00 MiB  in all\n");
    let error = table(&files(MOST_BYTES)).expect_err("it is a MiB larger");
    assert!(error.starts_with("the kit is larger than 60 MiB:\n"), "{error}");
    assert!(error.contains("60.00 MiB  tests.tar.gz") && error.contains("61.00 MiB  in all"), "{error}");
}

#[test]
fn shots_and_track_are_changed_for_the_kit() {
    let folder = env::temp_dir().join(format!("lanternfish-pages-{}", std::process::id()));
    let copied = |page: Page| copy_page(&page, &folder).and_then(|()| files::read(&folder.join(page.0)));
    let shots = SHOTS.map(|(shot, scene)| (copied((shot, PATHS)), scene));
    let (track, wrong) = (copied(TRACK), copied((SHOTS[0].0, &[("no such text", "")])));
    let _ = fs::remove_dir_all(&folder);
    for (shot, scene) in shots {
        let (shot, line) = (shot.expect("the path is there once"), format!("scene = \"../{}\"", SCENES[scene]));
        assert!(shot.lines().any(|other| other == line), "{shot}");
    }
    let track = track.expect("every change applies once");
    assert!(track.contains("[[track.keyframes]]") && TRACK.1.iter().all(|(line, _)| !track.contains(line)), "{track}");
    assert!(wrong.is_err_and(|error| error.contains("no such text")));
}

/// Tests the scripts with fake programs.
#[cfg(target_os = "linux")]
mod on_a_machine {
    use std::process::Output;

    use super::*;

    /// Adapters as `lanternfish info --adapters` lists them.
    const SOFTWARE: &str = "adapter      Some software\n  kind       Cpu, through vulkan\n  driver     x\n";
    const CARD: &str = "adapter      Some card\n  kind       DiscreteGpu, through vulkan\n  driver     x\n";

    /// A test program with three tests that need an adapter, of which `gpu_good` passes, and one other test.
    const TEST_PROGRAM: &str = r#"#!/bin/sh
if [ "$1" = --list ]; then
    printf 'a::gpu_good: test\na::gpu_second: test\ngpu_third: test\na::gpu::other: test\n'
    exit
fi
echo "on ${LANTERNFISH_TEST_ADAPTER-software}"
case $2 in
    a::gpu_second) SECOND ;;
    gpu_third) echo 'LEFT OUT: gpu_third: no ray query' ;;
    a::gpu::other) exit 1 ;;
esac
printf '\ntest result: ok. 1 passed; 0 failed; 0 ignored\n'
"#;

    /// A kit of fakes in a folder that is removed on drop.
    struct Kit(PathBuf);

    impl Kit {
        /// `second` is the command of the test `gpu_second`.
        fn new(name: &str, adapters: &str, second: &str) -> Self {
            let folder = env::temp_dir().join(format!("lanternfish-kit-{name}-{}", std::process::id()));
            let contents = folder.join("contents");
            make_empty(&folder.join("kit")).expect("it can be made");
            make_empty(&contents.join("tests")).expect("it can be made");
            let command_line = format!(
                "#!/bin/sh\ncase $1 in\n--version) echo fake ;;\ninfo) printf '{adapters}' ;;\n*) echo \"$@\" ;;\nesac\n"
            );
            let test_program = TEST_PROGRAM.replace("SECOND", second);
            // It writes its page and its data, and then takes as long as SLOW_S says.
            let bench =
                "#!/bin/sh\nwhile [ $# -gt 0 ]; do [ \"$1\" = -o ] && folder=$2; words=\"$words $1\"; shift; done\n\
                         echo$words | tee $folder/report.md\n\
                         echo \"{\\\"validates\\\": \\\"$WGPU_VALIDATION_INDIRECT_CALL\\\"}\" >$folder/report.json\n\
                         sleep ${SLOW_S:-0}\n"
                    .to_owned();
            let programs =
                [("lanternfish", command_line), ("lanternfish-bench", bench), ("tests/program", test_program)];
            for (name, text) in programs {
                let file = contents.join(name);
                fs::write(&file, text).and_then(|()| make_executable(&file)).expect("it can be written");
            }
            pack(&contents, &folder.join("kit")).expect("it can be packed");
            Self(folder)
        }

        fn run(&self, words: &[&str], variables: &[(&str, &str)]) -> Output {
            let mut bash = Command::new("bash");
            bash.arg(self.0.join("kit/run.sh")).args(words).arg("--out").arg(self.0.join("out"));
            bash.env("LANTERNFISH_TEST_ADAPTER", "of the caller").env("TMPDIR", &self.0).current_dir(&self.0);
            bash.envs(variables.iter().copied()).output().expect("bash is there")
        }

        /// Reads a result.
        fn read(&self, name: &str) -> String {
            fs::read_to_string(self.0.join("out").join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
        }
    }

    impl Drop for Kit {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn text(bytes: &[u8]) -> String {
        String::from_utf8_lossy(bytes).into_owned()
    }

    #[test]
    fn the_scripts_are_bash() {
        for (name, script) in SCRIPTS {
            assert_eq!(crate::command::run_with_input(Command::new("bash").arg("-n"), script), Ok(()), "{name}");
        }
        assert!(crate::command::run_with_input(Command::new("bash").arg("-n"), "if true; then").is_err());
    }

    #[test]
    fn a_software_adapter_alone_ends_the_run() {
        let kit = Kit::new("software", SOFTWARE, "true");
        let output = kit.run(&[], &[]);
        assert_eq!(output.status.code(), Some(3));
        let said = text(&output.stderr);
        assert!(said.contains("ONLY A SOFTWARE ADAPTER WAS FOUND") && said.contains("Some software"), "{said}");
        assert!(!kit.0.join("out/doctor.txt").exists());
    }

    #[test]
    #[ignore = "full"]
    fn software_is_used_if_it_is_allowed() {
        let kit = Kit::new("allowed", SOFTWARE, "test -z \"${LANTERNFISH_TEST_ADAPTER+set}\" || exit 1");
        let output = kit.run(&["--allow-software"], &[]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout) + &text(&output.stderr));
        let commit = fs::read_to_string(kit.0.join("kit/commit")).expect("the kit states its commit");
        let commit = if commit.is_empty() { commit } else { format!("--commit {commit} ") };
        assert!(kit.read("doctor.txt").starts_with(&format!("doctor --adapter cpu --quick {commit}--json ")));
        assert!(kit.read("tests.txt").ends_with("\n2 passed, 0 failed, 0 not run (deadline), 1 left out\n"));
        assert!(kit.read("frames.json").contains(r#"{"frame": "atrium", "status": 0, "report": null"#));
        let left = fs::read_dir(&kit.0).expect("it is there").filter_map(Result::ok);
        let left: Vec<_> = left.map(|entry| entry.file_name()).filter(|name| name != "out" && name != "kit").collect();
        assert_eq!(left, ["contents"], "the temporary folder is removed");
    }

    #[test]
    #[ignore = "full"]
    fn walks_are_measured_with_and_without_validation() {
        let kit = Kit::new("walks", SOFTWARE, "true");
        let output = kit.run(&["walks", "--allow-software"], &[]);
        assert_eq!(output.status.code(), Some(0), "{}{}", text(&output.stdout), text(&output.stderr));
        let [plain, validated] = ["walks.md", "walks-validated.md"].map(|name| kit.read(name));
        assert!(
            plain.contains("walks ")
                && plain.contains("tracks/atrium.toml --size 96x54")
                && plain.contains("--seconds 1")
        );
        assert!(!plain.contains("--only") && validated.contains("--only draft, direct all"), "{plain}{validated}");
        assert!(kit.read("walks.json").contains(r#""validates": """#));
        assert!(kit.read("walks-validated.json").contains(r#""validates": "1""#));
    }

    #[test]
    #[ignore = "full"]
    fn a_part_beyond_its_deadline_is_ended_and_keeps_its_rows() {
        let kit = Kit::new("slow-walks", SOFTWARE, "true");
        let output = kit.run(&["walks", "ab", "--allow-software"], &[("WALKS_S", "2"), ("SLOW_S", "60")]);
        let said = text(&output.stdout);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(kit.read("walks.md").contains("atrium.toml") && kit.read("walks.json").contains("validates"), "{said}");
        // The part's own output may begin with the same word.
        assert!(
            said.lines().any(|line| line.starts_with("walks ") && line.contains("FAILED: deadline")),
            "the deadline is stated: {said}"
        );
        assert!(
            said.lines().any(|line| line.starts_with("ab ") && line.contains("passed")),
            "the next part runs: {said}"
        );
        assert!(kit.read("ab.txt").starts_with("doctor --only ab --adapter cpu --seconds "));
    }

    #[test]
    #[ignore = "full"]
    fn tests_are_the_last_part() {
        let kit = Kit::new("order", SOFTWARE, "true");
        let said = text(&kit.run(&["--allow-software"], &[]).stdout);
        let parts =
            said.lines().filter_map(|line| line.strip_prefix("==> ")?.split_once(", up to ")).map(|(part, _)| part);
        let parts: Vec<_> = parts.filter(|part| !part.contains(' ')).collect();
        assert_eq!(parts, ["walks", "ab", "doctor", "frames", "tests"], "{said}");
    }

    #[test]
    #[ignore = "full"]
    fn papers_and_direct_light_are_one_report_each() {
        for (part, seconds, words) in
            [("papers", 1080, "papers --quick --seconds 5"), ("direct", 940, "direct demo:atrium ")]
        {
            let kit = Kit::new(part, SOFTWARE, "true");
            let output = kit.run(&[part, "--allow-software"], &[]);
            let said = text(&output.stdout);
            assert_eq!(output.status.code(), Some(0), "{said}{}", text(&output.stderr));
            assert!(said.contains(&format!("up to {seconds} s")), "the report has its own time: {said}");
            let mut tar = Command::new("tar");
            tar.arg("-xOzf").arg(kit.0.join(format!("out/{part}.tar.gz"))).arg(format!("{part}/{part}.txt"));
            let said = text(&tar.output().expect("tar is there").stdout);
            assert!(said.starts_with(words) && said.contains(" --adapter cpu -o "), "{said}");
        }
    }

    #[test]
    fn a_failing_test_fails_the_run_and_is_shown() {
        let kit = Kit::new("failing", &format!("{SOFTWARE}{CARD}"), "echo 'the reason'; exit 101");
        let output = kit.run(&["tests"], &[]);
        assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
        let tests = kit.read("tests.txt");
        let lines: Vec<_> = tests.lines().collect();
        let results =
            [("ok ", "program a::gpu_good"), ("FAILED ", "program a::gpu_second"), ("left out ", "gpu_third")];
        for (line, (word, name)) in lines.iter().zip(results) {
            assert!(line.starts_with(word) && line.ends_with(name), "{tests}");
        }
        assert!(lines.contains(&"on gpu") && lines.contains(&"the reason"), "{tests}");
        assert!(lines.contains(&"LEFT OUT: gpu_third: no ray query"), "{tests}");
        assert_eq!(lines.last(), Some(&"1 passed, 1 failed, 0 not run (deadline), 1 left out"));
    }

    #[test]
    #[ignore = "full"]
    fn a_test_that_crashes_hangs_or_runs_nothing_fails_the_run() {
        for (name, second, word) in [
            ("crash", "kill -SEGV $$", "CRASHED(SEGV) "),
            ("hang", "sleep 30", "TIMEOUT "),
            ("nothing", "echo 'test result: ok. 0 passed'; exit", "FAILED "),
        ] {
            let kit = Kit::new(name, CARD, second);
            let output = kit.run(&["tests"], &[("TEST_S", "1")]);
            assert_eq!(output.status.code(), Some(1), "{name}: {}", text(&output.stderr));
            let tests = kit.read("tests.txt");
            assert!(tests.lines().nth(1).is_some_and(|line| line.starts_with(word)), "{name}: {tests}");
        }
    }

    #[test]
    #[ignore = "full"]
    fn tests_after_the_deadline_are_not_run() {
        let kit = Kit::new("deadline", CARD, "sleep 30");
        // Time enough for the first test on a busy machine.
        kit.run(&["tests"], &[("TESTS_S", "4"), ("JOBS", "1")]);
        let tests = kit.read("tests.txt");
        assert!(tests.ends_with("\n1 passed, 0 failed, 2 not run (deadline), 0 left out\n"), "{tests}");
    }
}
