//! GIF files: animations of display values.

use std::{
    cell::RefCell,
    io::{self, Write},
    path::Path,
    rc::Rc,
};

use image::{
    Delay, Frame, RgbaImage,
    codecs::gif::{GifEncoder, Repeat},
};

use crate::{MetricsError, write_aside};

/// How fast a frame's 256 colours are chosen, from 1, the best choice, to 30.
const SPEED: i32 = 10;

/// An animation that repeats for ever, in memory until it is written. Each frame has 256 colours.
pub struct Animation {
    encoder: GifEncoder<Bytes>,
    bytes: Bytes,
    delay: Delay,
}

/// The encoded file, of which the encoder has a share.
#[derive(Clone, Default)]
struct Bytes(Rc<RefCell<Vec<u8>>>);

impl Write for Bytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Animation {
    /// An animation of so many frames per second. Players show a frame for hundredths of a second, two at least.
    pub fn new(fps: f32) -> Self {
        let bytes = Bytes::default();
        let mut encoder = GifEncoder::new_with_speed(bytes.clone(), SPEED);
        encoder.set_repeat(Repeat::Infinite).expect("no frame is written yet");
        // Casts saturate, and the format has 16 bits.
        let hundredths = ((100.0 / fps).round() as u32).clamp(2, u16::MAX.into());
        Self { encoder, bytes, delay: Delay::from_numer_denom_ms(10 * hundredths, 1) }
    }

    /// Adds a frame of sRGB-encoded pixels with alpha, which is 255, rows from the top. `size`: width and height, pixels.
    pub fn add(&mut self, [width, height]: [u32; 2], pixels: &[[u8; 4]]) -> Result<(), MetricsError> {
        let got = pixels.len();
        let image = RgbaImage::from_vec(width, height, pixels.as_flattened().to_vec());
        let expected = width as usize * height as usize;
        let image = image.ok_or(MetricsError::PixelCount { got, expected })?;
        self.encoder.encode_frame(Frame::from_parts(image, 0, 0, self.delay)).map_err(|error| MetricsError::Invalid {
            path: "GIF".into(),
            what: format!("a frame of {width} × {height} pixels cannot be written ({error})"),
        })
    }

    /// Ends the animation, and writes it completely or not at all.
    pub fn write(self, path: &Path) -> Result<(), MetricsError> {
        let Self { encoder, bytes, .. } = self;
        drop(encoder);
        write_aside(path, |file| file.write_all(&bytes.0.borrow()))
            .map_err(|source| MetricsError::Io { path: path.to_owned(), source })
    }
}

#[cfg(test)]
#[test]
fn frames_are_shown_one_after_the_other() {
    use image::{AnimationDecoder as _, codecs::gif::GifDecoder};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("turn.gif");
    let mut animation = Animation::new(24.0);
    let colors = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]];
    for color in colors {
        animation.add([6, 4], &[color; 24]).unwrap();
    }
    assert!(animation.add([6, 4], &[[0; 4]; 23]).is_err());
    animation.write(&path).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let frames = GifDecoder::new(file).unwrap().into_frames().collect_frames().unwrap();
    assert_eq!(frames.len(), 3);
    for (frame, color) in frames.iter().zip(colors) {
        assert_eq!((frame.buffer().dimensions(), frame.delay().numer_denom_ms()), ((6, 4), (40, 1)));
        assert!(frame.buffer().pixels().all(|pixel| pixel.0 == color), "{:?}", frame.buffer().get_pixel(0, 0));
    }
    assert!(std::fs::read(&path).unwrap().windows(11).any(|bytes| bytes == b"NETSCAPE2.0"), "it repeats");
}
