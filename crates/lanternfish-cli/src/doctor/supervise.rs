//! Runs the checks in a process of their own: a driver that ends it ends one check, and the rest is made by the next process.

use std::{
    env, fs, io,
    path::Path,
    process::{Child, Command, ExitStatus},
    thread,
    time::{Duration, SystemTime},
};

use super::{DoctorArgs, exit_code, read, report::Report};
use crate::{error::CliError, output::print};

/// What a process exits with that has lost its device: the next one opens another.
pub const LOST: u8 = 75;

/// How long a step may take.
const HARDWARE_STEP: Duration = Duration::from_secs(60);
const SOFTWARE_STEP: Duration = Duration::from_secs(600);

/// Processes that a driver may end before the rest is given up.
const MOST_ENDED: usize = 16;

/// The variable by which a process knows that it does the work, and in which file the report is.
pub const WORKER: &str = "LANTERNFISH_DOCTOR_WORKER";

pub fn run(args: &DoctorArgs) -> Result<u8, CliError> {
    let of_run = env::temp_dir().join(format!("lanternfish-doctor-{}.json", std::process::id()));
    let file = args.json.clone().unwrap_or_else(|| of_run.clone());
    // The report of another run is none that this one goes on with.
    let _ = fs::remove_file(&file);
    let program = env::current_exe().map_err(|error| CliError::new(format_args!("this program: {error}"), ""))?;
    let work = || {
        let mut worker = Command::new(&program);
        worker.args(env::args_os().skip(1)).env(WORKER, &file);
        let started = worker.spawn().and_then(|mut worker| wait(&mut worker, &file));
        started.map_err(|error| CliError::new(format_args!("{}: {error}", program.display()), ""))
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

/// Waits for a process, and ends it where it has not begun another step for too long: the device hangs.
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
    /// What was found; not complete where processes ended again and again.
    Report(Box<Report>),
    /// A process said on standard error why it could not begin.
    Refused(u8),
}

/// Starts processes until one has made the rest.
fn processes(file: &Path, mut work: impl FnMut() -> Result<ExitStatus, CliError>) -> Result<Outcome, CliError> {
    for ended in 0..=MOST_ENDED {
        let status = work()?;
        if !file.is_file() {
            // It has said why, unless it was ended.
            if let Some(code) = status.code().and_then(|code| u8::try_from(code).ok()).filter(|code| *code != 0) {
                return Ok(Outcome::Refused(code));
            }
            let hint = "another --adapter may do better; a newer driver may be at hand";
            return Err(CliError::new("the driver ended the process before the first check", hint));
        }
        let report = read(file)?;
        if report.complete || ended == MOST_ENDED {
            return Ok(Outcome::Report(Box::new(report)));
        }
    }
    unreachable!("the last round returns")
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

    /// Processes of two steps, of which the first ends in the first process.
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
    fn a_check_that_ends_its_process_has_failed_and_the_rest_is_made() {
        goes_on_after(signal());
        // A lost device, and a panic.
        goes_on_after(ExitStatus::from_raw(i32::from(LOST) << 8));
        goes_on_after(ExitStatus::from_raw(101 << 8));
    }

    #[test]
    fn a_process_that_goes_on_is_not_ended() {
        let folder = tempfile::tempdir().unwrap();
        let mut short = Command::new("true").spawn().unwrap();
        assert!(wait(&mut short, &folder.path().join("report.json")).unwrap().success());
    }

    #[test]
    fn processes_that_end_again_and_again_are_given_up() {
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
    fn a_process_that_is_ended_before_it_writes_is_an_error_and_one_that_refuses_is_its_code() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("report.json");
        assert!(processes(&file, || Ok(signal())).is_err());
        let refused = processes(&file, || Ok(ExitStatus::from_raw(1 << 8))).unwrap();
        assert!(matches!(refused, Outcome::Refused(1)));
    }
}
