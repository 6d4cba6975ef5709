//! Runs the checks in a separate process. If a driver ends it, that check fails and the next process runs the rest.

use std::{
    env, fs, io,
    path::Path,
    process::{Child, ExitStatus},
    thread,
    time::{Duration, SystemTime},
};

use super::{DoctorArgs, exit_code, read, report::Report};
use crate::{error::CliError, output::print, program};

/// Exit code of a process that lost its device: the next process opens a new one.
pub const LOST: u8 = 75;

/// Time limit of a step.
const HARDWARE_STEP: Duration = Duration::from_secs(60);
const SOFTWARE_STEP: Duration = Duration::from_secs(600);

/// Ended processes after which the run gives up.
const MOST_ENDED: usize = 16;

/// Environment variable that marks a worker process. Its value is the path of the report.
pub const WORKER: &str = "LANTERNFISH_DOCTOR_WORKER";

pub fn run(args: &DoctorArgs) -> Result<u8, CliError> {
    let of_run = env::temp_dir().join(format!("lanternfish-doctor-{}.json", std::process::id()));
    let file = args.json.clone().unwrap_or_else(|| of_run.clone());
    // Remove the report of another run, which this run must not continue.
    let _ = fs::remove_file(&file);
    let work = || {
        let mut worker = program::again()?;
        worker.args(program::arguments()).env(WORKER, &file);
        let started = worker.spawn().and_then(|mut worker| wait(&mut worker, &file));
        started.map_err(|error| CliError::new(format_args!("{}: {error}", worker.get_program().display()), ""))
    };
    let result = processes(&file, work);
    let _ = fs::remove_file(&of_run);
    match result? {
        Outcome::Report(report) => {
            print(&report.to_table())?;
            Ok(exit_code(&report))
        }
        Outcome::Refused(code) => Ok(code),
    }
}

/// Waits for a process. Kills it if no new step began for too long: the device hangs.
fn wait(worker: &mut Child, file: &Path) -> io::Result<ExitStatus> {
    let started = SystemTime::now();
    let mut longest = SOFTWARE_STEP;
    loop {
        if let Some(status) = worker.try_wait()? {
            return Ok(status);
        }
        thread::sleep(Duration::from_millis(100));
        let written = fs::metadata(file).and_then(|about| about.modified()).unwrap_or(started).max(started);
        let since = written.elapsed().unwrap_or_default();
        if since > HARDWARE_STEP && longest > HARDWARE_STEP {
            let report = read(file).ok();
            let is_hardware = report.is_some_and(|report| report.adapters[report.chosen].kind != "Cpu");
            longest = if is_hardware { HARDWARE_STEP } else { SOFTWARE_STEP };
        }
        if since > longest {
            worker.kill()?;
        }
    }
}

enum Outcome {
    /// The report. It is incomplete if processes ended too often.
    Report(Box<Report>),
    /// A process wrote to standard error why it could not begin. Holds its exit code.
    Refused(u8),
}

/// Starts processes until one has finished the remaining steps.
fn processes(file: &Path, mut work: impl FnMut() -> Result<ExitStatus, CliError>) -> Result<Outcome, CliError> {
    for ended in 0..=MOST_ENDED {
        let status = work()?;
        if !file.is_file() {
            // The process has reported the reason, unless it was killed.
            if let Some(code) = status.code().and_then(|code| u8::try_from(code).ok()).filter(|code| *code != 0) {
                return Ok(Outcome::Refused(code));
            }
            let hint = "try another --adapter, or update the driver";
            return Err(CliError::new("the driver ended the process before the first check", hint));
        }
        let report = read(file)?;
        if report.complete || ended == MOST_ENDED {
            return Ok(Outcome::Report(Box::new(report)));
        }
    }
    unreachable!("the last iteration returns")
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::process::ExitStatusExt;

    use super::{
        super::{Step, checks::plans, remaining, report::tests::report as sample},
        *,
    };

    fn signal() -> ExitStatus {
        ExitStatus::from_raw(11)
    }

    /// Runs two steps; the first step ends the first process with this status.
    fn goes_on_after(first: ExitStatus) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("report.json");
        let steps: Vec<Step> = plans().into_iter().take(2).map(Step::Check).collect();
        let mut started = 0;
        let work = || {
            started += 1;
            let mut report = match started {
                1 => Report { complete: false, begun: 0, ..sample(Vec::new()) },
                _ => read(&file).unwrap(),
            };
            let left = remaining(&mut report, &steps);
            assert_eq!(left.len(), if started == 1 { 2 } else { 1 });
            report.begun += 1;
            report.complete = started == 2;
            fs::write(&file, report.to_json()).unwrap();
            Ok(if started == 1 { first } else { ExitStatus::default() })
        };
        let Outcome::Report(report) = processes(&file, work).unwrap() else { panic!("no report") };
        assert_eq!((started, report.begun, report.failures().count(), exit_code(&report)), (2, 2, 1, 1));
        assert!(report.to_table().contains("or the process ended"), "{}", report.to_table());
    }

    #[test]
    fn a_check_that_ends_its_process_fails_and_the_rest_runs() {
        goes_on_after(signal());
        // Test a lost device and a panic.
        goes_on_after(ExitStatus::from_raw(i32::from(LOST) << 8));
        goes_on_after(ExitStatus::from_raw(101 << 8));
    }

    #[test]
    fn a_process_that_makes_progress_is_not_killed() {
        let folder = tempfile::tempdir().unwrap();
        let mut short = std::process::Command::new("true").spawn().unwrap();
        assert!(wait(&mut short, &folder.path().join("report.json")).unwrap().success());
    }

    #[test]
    fn the_run_gives_up_after_too_many_ended_processes() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("report.json");
        let report = Report { complete: false, doing: Some("sorting".to_owned()), ..sample(Vec::new()) };
        fs::write(&file, report.to_json()).unwrap();
        let mut started = 0;
        let work = || {
            started += 1;
            Ok(signal())
        };
        let Outcome::Report(report) = processes(&file, work).unwrap() else { panic!("no report") };
        assert_eq!((started, exit_code(&report)), (MOST_ENDED + 1, 1));
    }

    #[test]
    fn a_process_without_a_report_is_an_error_or_returns_its_exit_code() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("report.json");
        assert!(processes(&file, || Ok(signal())).is_err());
        let refused = processes(&file, || Ok(ExitStatus::from_raw(1 << 8))).unwrap();
        assert!(matches!(refused, Outcome::Refused(1)));
    }
}
