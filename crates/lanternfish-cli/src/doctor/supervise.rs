//! Runs the checks in a process of their own: a driver that ends it ends one check, and the rest is made by the next process.

use std::{
    env, fs,
    path::Path,
    process::{Command, ExitStatus},
};

use super::{DoctorArgs, exit_code, read, report::Report};
use crate::{error::CliError, output::print};

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
        worker.status().map_err(|error| CliError::new(format_args!("{}: {error}", program.display()), ""))
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
        if let Some(code) = status.code().filter(|code| *code != 0) {
            return Ok(Outcome::Refused(u8::try_from(code).unwrap_or(1)));
        }
        if !file.is_file() {
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
        super::{Step, checks::plans, mark_ended, report::tests::report as sample},
        *,
    };

    fn signal() -> ExitStatus {
        ExitStatus::from_raw(11)
    }

    #[test]
    fn a_check_that_ends_its_process_has_failed_and_the_rest_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("report.json");
        let plan = plans().remove(0);
        let mut started = 0;
        let work = || {
            started += 1;
            let mut report = match started {
                1 => Report { complete: false, begun: 1, ..sample(Vec::new()) },
                _ => read(&file).unwrap(),
            };
            if started == 2 {
                mark_ended(&mut report, &Step::Check(plan.clone()));
                report.complete = true;
            }
            fs::write(&file, report.to_json()).unwrap();
            Ok(if started == 1 { signal() } else { ExitStatus::default() })
        };
        let Outcome::Report(report) = processes(&file, work).unwrap() else { panic!("no report") };
        assert_eq!((started, report.failures().count(), exit_code(&report)), (2, 1, 1));
        assert!(report.to_table().contains("the process ended here"), "{}", report.to_table());
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
