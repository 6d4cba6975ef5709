//! Warm-up before a figure. An idle graphics card lowers its clocks and takes about a second of work to raise them; a driver sorts and
//! compiles during the first runs.

use std::{
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use lanternfish_gpu::Gpu;

use crate::error::CliError;

/// Least time of the runs before the first that counts.
const WARM_UP: Duration = Duration::from_millis(1500);

/// Time after the warm-up for which a reading of the clocks is awaited.
const MOST_READING: Duration = Duration::from_secs(3);

/// A program that prints the clocks, and its arguments.
type Reader<'a> = &'a [&'a str];

/// Clocks of processors and memory, and the power, of NVIDIA cards.
const NVIDIA: Reader<'static> = &["nvidia-smi", "--query-gpu=clocks.sm,clocks.mem,power.draw", "--format=csv,noheader"];

/// The PCI vendor of NVIDIA, whose driver has this program.
const NVIDIA_VENDOR: u32 = 0x10de;

/// Said where no program tells the clocks.
pub const NO_CLOCKS: &str = "not logged (no nvidia-smi, or no card of NVIDIA)";

/// Makes a device work before a figure, and reads its clocks. On a software adapter, which has no clocks of its own, a single run.
pub fn up(gpu: &Gpu, run: impl FnMut() -> Result<(), CliError>) -> Result<Option<String>, CliError> {
    let is_software = gpu.description.kind == wgpu::DeviceType::Cpu;
    let reader = (gpu.device.adapter_info().vendor == NVIDIA_VENDOR && !is_software).then_some(NVIDIA);
    up_for(if is_software { Duration::ZERO } else { WARM_UP }, reader, run)
}

/// Repeats `run` for at least this time. Returns the clocks at its end, while the device still works, if there is a reader and it runs.
fn up_for(
    warm_up: Duration,
    reader: Option<Reader<'_>>,
    mut run: impl FnMut() -> Result<(), CliError>,
) -> Result<Option<String>, CliError> {
    let started = Instant::now();
    let mut reading = None;
    loop {
        run()?;
        let elapsed = started.elapsed();
        if reading.is_none() && 2 * elapsed >= warm_up {
            reading = Some(reader.and_then(Reading::start));
        }
        let is_read = reading.iter_mut().flatten().all(|reading| reading.is_done(elapsed > warm_up + MOST_READING));
        if elapsed >= warm_up && is_read {
            return Ok(reading.flatten().and_then(Reading::text));
        }
    }
}

/// A program that reads the clocks while the device works.
struct Reading(Child);

impl Reading {
    fn start(reader: Reader<'_>) -> Option<Self> {
        let (program, words) = reader.split_first()?;
        let mut command = Command::new(program);
        command.args(words).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        command.spawn().ok().map(Self)
    }

    /// True if the program has ended; ends it if it `is_late`.
    fn is_done(&mut self, is_late: bool) -> bool {
        if is_late {
            let _ = self.0.kill();
        }
        is_late || !matches!(self.0.try_wait(), Ok(None))
    }

    fn text(self) -> Option<String> {
        let output = self.0.wait_with_output().ok().filter(|output| output.status.success())?;
        let text = String::from_utf8_lossy(&output.stdout);
        // One line for each card.
        let lines: Vec<_> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        (!lines.is_empty()).then(|| lines.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(reader: Option<Reader<'_>>) -> (u32, Duration, Option<String>) {
        let (mut count, started) = (0, Instant::now());
        let clocks = up_for(Duration::from_millis(60), reader, || {
            count += 1;
            std::thread::sleep(Duration::from_millis(10));
            Ok(())
        });
        (count, started.elapsed(), clocks.unwrap())
    }

    #[test]
    fn the_device_works_for_the_whole_warm_up() {
        let (count, time, clocks) = runs(None);
        assert!((2..=6).contains(&count) && time >= Duration::from_millis(60), "{count} runs in {time:?}");
        assert_eq!(clocks, None);
        assert_eq!(runs(Some(&["no-such-program"])).2, None);
    }

    #[cfg(unix)]
    #[test]
    fn clocks_are_read_while_the_device_works() {
        let (count, _, clocks) = runs(Some(&["sh", "-c", "sleep 0.2; echo '1980 MHz, 2619 MHz, 400 W '"]));
        assert_eq!(clocks.as_deref(), Some("1980 MHz, 2619 MHz, 400 W"));
        assert!(count > 8, "{count} runs in 230 ms");
        assert_eq!(runs(Some(&["sh", "-c", "echo no; exit 1"])).2, None);
    }
}
