//! Tests of the window on a separate display, driven by keys and pointer.

#[cfg(target_os = "linux")]
mod dropped;
mod panels;
mod rain;
mod rest;
mod stereo;

use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use lanternfish_metrics::read_png;

use crate::support::{Ran, lanternfish};

/// Longest wait for an event that normally takes seconds.
const LONGEST: Duration = Duration::from_secs(240);
const SIZE: [usize; 2] = [400, 300];

/// A process that does not outlive the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // The process may have exited already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual display, and the folder of its screen file.
struct Display {
    _server: Running,
    name: String,
    folder: tempfile::TempDir,
    /// Size of the window's part of the screen, pixels.
    size: [usize; 2],
}

impl Display {
    /// Opens a display; `None` if the required programs are missing.
    fn open(test: &str) -> Option<Self> {
        Some(Self { size: SIZE, ..Self::of(test, [640, 480])? })
    }

    /// Opens a display of this size, which the window fills.
    fn of(test: &str, size: [usize; 2]) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let mut server = Command::new("Xvfb");
        // Without -noreset it starts again when its last client leaves, such as xdotool before the window is there, and
        // refuses the next.
        server
            .args([
                "-noreset",
                "-displayfd",
                "1",
                "-screen",
                "0",
                &format!("{}x{}x24", size[0], size[1]),
                "-nolisten",
                "tcp",
                "-fbdir",
            ])
            .arg(folder.path());
        let server = server.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let driver = Command::new("xdotool").arg("version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        let (Ok(server), Ok(_)) = (server, driver) else {
            println!("LEFT OUT (tool): {test}: Xvfb or xdotool is not on PATH");
            return None;
        };
        let mut server = Running(server);
        let mut number = String::new();
        BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Self { _server: server, name: format!(":{}", number.trim()), folder, size })
    }

    /// Runs pointer and key commands.
    #[track_caller]
    fn act(&self, words: &str) -> String {
        let output = Command::new("xdotool").args(words.split(' ')).env("DISPLAY", &self.name).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    }

    /// The window's part of the screen: blue, green, red, row by row. The file is in the format of `xwd`: big-endian
    /// words, of which the first is the header's length, the 13th the bytes of a row and the 20th the number of colours
    /// of 12 bytes that follow it.
    fn screen(&self) -> Vec<[u8; 3]> {
        let file = fs::read(self.folder.path().join("Xvfb_screen0")).unwrap();
        let word = |index: usize| u32::from_be_bytes(file[4 * index..][..4].try_into().unwrap()) as usize;
        let (first, row) = (word(0) + 12 * word(19), word(12));
        let pixel = |x: usize, y: usize| file[first + y * row + 4 * x..][..3].try_into().unwrap();
        let [width, height] = self.size;
        (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
    }

    /// Waits until the screen is stable and meets a condition.
    #[track_caller]
    fn settled(&self, what: &str, is_wanted: impl Fn(&[[u8; 3]]) -> bool) -> Vec<[u8; 3]> {
        let mut last = self.screen();
        wait_for(what, || {
            sleep(Duration::from_millis(700));
            let before = std::mem::replace(&mut last, self.screen());
            (are_alike(&last, &before) && is_wanted(&last)).then(|| last.clone())
        })
    }
}

#[track_caller]
fn wait_for<T>(what: &str, mut evaluate: impl FnMut() -> Option<T>) -> T {
    let started = Instant::now();
    loop {
        if let Some(value) = evaluate() {
            return value;
        }
        assert!(started.elapsed() < LONGEST, "timed out waiting for: {what}");
        sleep(Duration::from_millis(50));
    }
}

/// True for an image, not a panel: it has many colours.
fn is_image(screen: &[[u8; 3]]) -> bool {
    let colors: std::collections::BTreeSet<_> = screen.iter().collect();
    colors.len() > 300
}

/// True if two screens are equal, except for edges that change with further averaged frames: 2 % of the pixels.
fn are_alike(a: &[[u8; 3]], b: &[[u8; 3]]) -> bool {
    50 * a.iter().zip(b).filter(|(a, b)| is_other(**a, **b)).count() < a.len()
}

/// True if two colours differ by more than noise.
fn is_other(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).any(|(a, b)| a.abs_diff(b) > 24)
}

/// The screenshot of a converged image: repeated until two are equal.
fn screenshot(display: &Display, folder: &Path) -> PathBuf {
    let mut number = 0;
    let mut before = Vec::new();
    wait_for("a converged image", || {
        number += 1;
        let path = folder.join(format!("lanternfish-{number}.png"));
        display.act("key F2");
        let bytes = wait_for("a screenshot", || fs::read(&path).ok().filter(|bytes| !bytes.is_empty()));
        sleep(Duration::from_secs(2));
        let is_same = bytes == before;
        before = bytes;
        is_same.then_some(path)
    })
}

/// Saves a shot of a converged image, closes the window, and renders the shot: the images are equal to the bit. Returns
/// the shot's text.
fn saved_as_seen(display: &Display, folder: &Path, view: Running) -> String {
    display.act("key F4");
    let shot = folder.join("lanternfish-1.toml");
    wait_for("a shot", || shot.exists().then_some(()));
    let seen = screenshot(display, folder);
    let shown = display.screen();
    close(display, view);
    Ran::of(lanternfish(folder).args(["render", "lanternfish-1.toml", "-o", "rendered.png"])).succeeded();
    let (seen, rendered) = (read_png(&seen).unwrap(), read_png(&folder.join("rendered.png")).unwrap());
    assert_eq!((seen.width, seen.height), (SIZE[0], SIZE[1]));
    let others = seen.pixels.iter().zip(&rendered.pixels).filter(|(seen, rendered)| seen != rendered).count();
    assert_eq!(others, 0, "pixels differ between the window and the rendered shot");
    // The screenshot equals its file except for rounding of display bytes.
    let bytes = seen.pixels.iter().map(|pixel| pixel.map(|value| (255.0 * value).round() as i32));
    let shown = shown.iter().map(|[blue, green, red]| [red, green, blue].map(|byte| i32::from(*byte)));
    let farthest = bytes.zip(shown).flat_map(|(a, b)| [0, 1, 2].map(|channel| (a[channel] - b[channel]).abs())).max();
    assert!(farthest <= Some(1), "{farthest:?} between the screen and the screenshot");
    fs::read_to_string(&shot).unwrap()
}

/// Closes a window, whose program succeeds.
#[track_caller]
fn close(display: &Display, mut view: Running) {
    display.act("key Escape");
    assert!(wait_for("the end", || view.0.try_wait().unwrap()).success());
}

/// Opens a window of the Cornell box, and hides its panels. Returns its image, too.
fn open_alone(display: &Display, folder: &Path, words: &str) -> (Running, Vec<[u8; 3]>) {
    let view = open(display, folder, words);
    display.settled("the panels", |screen| screen.iter().any(|pixel| pixel.iter().any(|byte| *byte > 0)));
    display.act("mousemove 600 460");
    display.act("key F3");
    let image = display.settled("the image without panels", is_image);
    (view, image)
}

/// Opens a window of the Cornell box in the corner of the display, and focuses it. Its output goes to the folder's
/// `log`.
fn open(display: &Display, folder: &Path, words: &str) -> Running {
    let log = fs::File::create(folder.join("log")).unwrap();
    let mut view = lanternfish(folder);
    view.args(format!("view demo:cornell --adapter cpu --indirect none {words}").split(' '));
    view.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY").env("WINIT_X11_SCALE_FACTOR", "1");
    view.env("XDG_CONFIG_HOME", folder.join("config")).env("RUST_LOG", "warn,lanternfish_viewer=debug");
    let mut view = Running(view.stdout(log.try_clone().unwrap()).stderr(log).spawn().unwrap());
    let window = wait_for("a window", || {
        let said = || fs::read_to_string(folder.join("log")).unwrap();
        assert!(view.0.try_wait().unwrap().is_none(), "it has ended: {}", said());
        let windows = display.act("search --name Lanternfish");
        windows.lines().next().map(str::to_owned)
    });
    display.act(&format!("windowmove {window} 0 0"));
    display.act(&format!("windowfocus --sync {window}"));
    view
}

/// A recorded flight is written when the window is closed, and can be replayed.
#[test]
#[ignore = "full"]
fn gpu_a_flight_is_recorded_and_played_again() {
    let Some(display) = Display::open("gpu_a_flight_is_recorded_and_played_again") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (view, first) = open_alone(&display, folder.path(), "--size 400x300 --record flight.toml");
    display.act("keydown w");
    wait_for("another image", || (!are_alike(&display.screen(), &first)).then_some(()));
    display.act("keyup w");
    close(&display, view);

    let flight = fs::read_to_string(folder.path().join("flight.toml")).unwrap();
    assert!(flight.contains("\"fly\", 0.0, 0.0, 1.0"), "{flight}");
    let words = ["replay", "flight.toml", "--adapter", "cpu", "--runs", "1", "--frames", "0-3", "-o", "again"];
    Ran::of(lanternfish(folder.path()).args(words)).succeeded();
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("again/report.json")).unwrap()).unwrap();
    assert_eq!((report["frames"].as_array().unwrap().len(), &report["width"]), (4, &400.into()));
}

/// Copies the library's shaders to a separate folder.
fn copy_shaders(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let (path, name) = entry.map(|entry| (entry.path(), entry.file_name())).unwrap();
        if path.is_dir() {
            copy_shaders(&path, &to.join(name));
        } else if path.extension().is_some_and(|ending| ending == "wesl") {
            fs::copy(&path, to.join(name)).unwrap();
        }
    }
}

/// A shader that does not compile changes nothing; once corrected, it takes effect.
#[test]
#[ignore = "full"]
fn gpu_shaders_are_read_again_when_they_are_saved() {
    let Some(display) = Display::open("gpu_shaders_are_read_again_when_they_are_saved") else { return };
    let folder = tempfile::tempdir().unwrap();
    copy_shaders(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../lanternfish/src"), &folder.path().join("src"));
    let (view, first) = open_alone(&display, folder.path(), "--size 400x300 --shaders src");
    let file = folder.path().join("src/materials/brdf.wesl");
    let text = fs::read_to_string(&file).unwrap();
    let piece = "let diffuse = surface.albedo * ";
    assert!(text.contains(piece), "the shader has other words");

    fs::write(&file, text.replace(piece, "let diffuse = surface.albedo ** ")).unwrap();
    sleep(Duration::from_secs(3));
    assert!(are_alike(&display.screen(), &first), "a broken shader changes nothing");
    // The error is displayed below the image.
    display.act("key F3");
    let told = display.settled("the panels with what is wrong", |screen| !are_alike(screen, &first));
    display.act("key F3");
    display.settled("the image again", |screen| are_alike(screen, &first));

    fs::write(&file, text.replace(piece, "let diffuse = surface.albedo.bgr * ")).unwrap();
    let saved = Instant::now();
    wait_for("other colours", || (!are_alike(&display.screen(), &first)).then_some(()));
    println!("seen {} ms after it was saved", saved.elapsed().as_millis());
    fs::write(&file, &text).unwrap();
    display.settled("the previous colours", |screen| are_alike(screen, &first));
    display.act("key F3");
    display.settled("the panels without what was wrong", |screen| *screen != told);
    close(&display, view);
}

/// Opens a window, hides the panels, flies, shows the keys, draws and drags the line of Compare, focuses a clicked
/// pixel, saves a shot and closes the window. The shot then renders the window's image to the bit.
#[test]
#[ignore = "full"]
fn gpu_a_window_is_driven_and_its_shot_is_its_image() {
    let Some(display) = Display::open("gpu_a_window_is_driven_and_its_shot_is_its_image") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (view, first) = open_alone(&display, folder.path(), "--size 400x300");
    display.act("keydown w");
    sleep(Duration::from_millis(500));
    display.act("keyup w");
    let flown = display.settled("another image", |screen| is_image(screen) && !are_alike(screen, &first));

    display.act("key F1");
    display.settled("the page of keys", |screen| !are_alike(screen, &flown));
    display.act("key F1");
    display.settled("the same image behind it", |screen| are_alike(screen, &flown));

    // Both sides are equal: only the line and its letters differ from before.
    let differs = |screen: &[[u8; 3]], x: usize| {
        let rows = 60..SIZE[1];
        let others = rows.clone().filter(|y| is_other(screen[y * SIZE[0] + x], flown[y * SIZE[0] + x])).count();
        2 * others > rows.len()
    };
    display.act("key b");
    let is_line_at = |screen: &[[u8; 3]], x: usize| {
        let mut elsewhere = (10..SIZE[0] - 10).filter(|at| at.abs_diff(x) > 3);
        (x - 2..=x + 2).any(|x| differs(screen, x)) && !elsewhere.any(|x| differs(screen, x))
    };
    display.settled("a line in the middle", |screen| is_line_at(screen, 200));
    for words in
        ["mousemove 200 200", "mousedown 1", "mousemove 150 200", "mousemove 100 200", "mouseup 1", "mousemove 600 460"]
    {
        display.act(words);
        sleep(Duration::from_millis(300));
    }
    display.settled("the line where it was dragged", |screen| is_line_at(screen, 100));
    display.act("key b");
    display.settled("no line", |screen| are_alike(screen, &flown));

    display.act("mousemove 120 260");
    sleep(Duration::from_millis(300));
    display.act("click 1");
    display.act("mousemove 600 460");
    // The position under the pixel may not be available yet.
    wait_for("the camera to look there", || {
        display.act("key f");
        sleep(Duration::from_secs(1));
        (!are_alike(&display.screen(), &flown)).then_some(())
    });

    saved_as_seen(&display, folder.path(), view);
}
