//! Room for lists whose length is known on the device alone.
//!
//! - [`Growth::Wait`]: a list is counted, the host reads how long it is, makes room, and it is written. Every frame is whole.
//! - [`Growth::Later`]: no frame waits. Lists have the room that earlier frames have shown to be enough, and half as much again; what
//!   this frame counts is read when it arrives. A frame that lacks room notes that it is not whole, and is not shown.

mod room;
mod staging;
#[cfg(all(test, feature = "testing"))]
mod tests;

use std::collections::HashMap;

use self::{room::Room as History, staging::Staging};
use crate::{Bindings, ComputeKernel, Frame, GpuError, buffer::STORAGE, gpu_struct, made, primitives::SHADERS};

gpu_struct! {
    /// A list of the frame.
    struct NoteParameters {
        /// Which it is, from 0.
        list: u32,
        /// Elements that it has room for.
        capacity: u32,
    }
}

/// When lists get more room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Growth {
    /// In the frame that needs it, which waits for the device.
    #[default]
    Wait,
    /// In a later frame.
    Later,
}

/// A list that the device has counted.
#[derive(Clone, Copy)]
pub struct Counted<'a> {
    /// Its name. Lists of one name have the same room.
    pub list: &'static str,
    /// Four words: elements of it, and what else the host wants to know.
    pub words: &'a wgpu::Buffer,
    /// Where its parts start, and how many starts there are, the last being where the last part ends.
    pub starts: (&'a wgpu::Buffer, usize),
    /// Whether with these words the number of elements may have started over at 2³²: then the parts are added up.
    pub may_wrap: &'a dyn Fn(&[u32; LIST_WORDS]) -> bool,
    /// Elements that there is room for before anything was counted.
    pub guess: u64,
    /// Elements at most.
    pub limit: u64,
}

/// The room for a list.
#[derive(Clone, Copy, Debug)]
pub struct ListRoom {
    /// Elements that there is room for: at most the limit.
    pub capacity: u64,
    /// Elements of the list, more than the limit too: in this frame, or where frames do not wait in the last one that has arrived.
    pub elements: u64,
    /// The words of the same frame.
    pub words: [u32; LIST_WORDS],
}

/// What has arrived of frames that did not wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrived {
    /// Frames.
    pub frames: u64,
    /// Those of them that were not whole.
    pub held: u64,
}

/// Words a list in the ledger, and those before the first: `note.wesl`.
pub(crate) const LIST_WORDS: usize = 4;
const FIRST_LIST: usize = 8;
/// Where the number of frames of a mean lies.
const FRAMES: usize = 4;
/// Lists of a frame at most.
const MOST_LISTS: usize = 1022;
const LEDGER_BYTES: u64 = 4 * (FIRST_LIST + LIST_WORDS * MOST_LISTS) as u64;

/// Room of all lists, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    lists: HashMap<&'static str, History>,
    later: Option<Later>,
}

/// What frames that do not wait need.
#[derive(Debug)]
struct Later {
    note: ComputeKernel,
    count_frame: ComputeKernel,
    words: wgpu::Buffer,
    staging: Staging,
    /// The lists of the frame in hand.
    noted: Vec<&'static str>,
    arrived: Arrived,
}

impl Ledger {
    /// From now on.
    pub fn set_growth(&mut self, device: &wgpu::Device, growth: Growth) -> Result<(), GpuError> {
        self.later = match growth {
            Growth::Wait => None,
            Growth::Later => Some(Later::new(device)?),
        };
        Ok(())
    }

    pub fn whole(&self) -> Option<wgpu::Buffer> {
        self.later.as_ref().map(|later| later.words.clone())
    }

    pub fn arrived(&self) -> Arrived {
        self.later.as_ref().map_or_else(Arrived::default, |later| later.arrived)
    }

    /// Reads what has arrived, without waiting.
    pub fn begin(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) {
        let Some(later) = &mut self.later else { return };
        // What is wrong with the device shows where the frame is handed to it.
        let _ = device.poll(wgpu::PollType::Poll);
        later.noted.clear();
        for (lists, words) in later.staging.arrived() {
            later.arrived.frames += 1;
            later.arrived.held += u64::from(words[1] == 0);
            let of_lists = words[FIRST_LIST..].chunks_exact(LIST_WORDS);
            for (name, words) in lists.iter().zip(of_lists) {
                let words = words.try_into().expect("a chunk has as many");
                self.lists.get_mut(name).expect("it was asked for").arrives(words);
            }
            self.lists.values_mut().for_each(History::adapt);
        }
        // Three vertices, one instance: as long as nothing is noted, the picture is drawn.
        queue.write_buffer(&later.words, 0, bytemuck::bytes_of(&[3u32, 1, 0, 0]));
    }

    /// What comes last in the frame's commands.
    pub fn end(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(later) = &mut self.later {
            later.staging.copy(&later.words, &later.noted, encoder);
        }
    }

    /// The commands are on their way.
    pub fn submitted(&mut self) {
        if let Some(later) = &mut self.later {
            later.staging.map();
        }
    }
}

impl Later {
    fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        let shader = SHADERS.link("ledger/note", &[])?;
        made::count(|made| made.buffers += 1);
        let words = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("ledger"),
            size: LEDGER_BYTES,
            usage: STORAGE | wgpu::BufferUsages::INDIRECT,
            mapped_at_creation: false,
        });
        Ok(Self {
            note: ComputeKernel::new(device, &shader, "note", "ledger/note"),
            count_frame: ComputeKernel::new(device, &shader, "count_frame", "ledger/count_frame"),
            words,
            staging: Staging::new(device, LEDGER_BYTES),
            noted: Vec::new(),
            arrived: Arrived::default(),
        })
    }
}

impl Frame<'_> {
    /// When lists of this frame get more room.
    pub fn growth(&self) -> Growth {
        if self.pool.ledger.later.is_some() { Growth::Later } else { Growth::Wait }
    }

    /// Room for a list whose elements the commands so far have counted. Without waiting the frame notes, when it runs, whether the room
    /// is enough. More elements than the limit are left to the caller to refuse.
    pub fn room_for(&mut self, counted: &Counted<'_>) -> Result<ListRoom, GpuError> {
        let capacity = self.planned_room(counted.list, counted.guess, counted.limit);
        self.counted_room(counted, capacity)
    }

    /// Room for a list that is counted while it is written: what was enough before, in elements. When it is written,
    /// [`Self::counted_room`] says whether it was enough.
    pub fn planned_room(&mut self, list: &'static str, guess: u64, limit: u64) -> u64 {
        let growth = self.growth();
        let list = self.pool.ledger.lists.entry(list).or_default();
        match growth {
            Growth::Wait => list.before_waiting(guess, limit),
            Growth::Later => list.later(guess, limit),
        }
    }

    /// The words of the longest list of this name in the last frame that has arrived, where frames do not wait.
    pub fn last_counted(&self, list: &'static str) -> [u32; LIST_WORDS] {
        let ledger = &self.pool.ledger;
        let history = ledger.lists.get(list).filter(|_| ledger.later.is_some());
        history.map_or([0; LIST_WORDS], |history| history.last)
    }

    /// Whether room for `capacity` elements is enough for a list that the commands so far have counted: where the frame waits, it is
    /// the caller's to write the list again in the room that this returns; where it does not, the frame notes it when it runs.
    pub fn counted_room(&mut self, counted: &Counted<'_>, capacity: u64) -> Result<ListRoom, GpuError> {
        match self.growth() {
            Growth::Wait => {
                let words: [u32; LIST_WORDS] =
                    self.read_now(counted.words, LIST_WORDS)?.try_into().expect("as many as were asked for");
                let (starts, count) = counted.starts;
                let elements = match (counted.may_wrap)(&words) {
                    false => u64::from(words[0]),
                    true => sum_of_parts(&self.read_now::<u32>(starts, count)?),
                };
                let list = self.pool.ledger.lists.entry(counted.list).or_default();
                Ok(ListRoom {
                    capacity: list.waited_for(counted.list, counted.guess, counted.limit, elements),
                    elements,
                    words,
                })
            }
            Growth::Later => {
                let list = self.pool.ledger.lists.entry(counted.list).or_default();
                let words = list.last;
                if u64::from(words[0]) > counted.limit {
                    // It is told once. Whether it is so still, the next frame finds out.
                    list.last = [0; LIST_WORDS];
                }
                self.note(counted, capacity)?;
                Ok(ListRoom { capacity, elements: words[0].into(), words })
            }
        }
    }

    fn note(&mut self, counted: &Counted<'_>, capacity: u64) -> Result<(), GpuError> {
        let Some(mut later) = self.pool.ledger.later.take() else { return Ok(()) };
        let list = later.noted.len();
        if list >= MOST_LISTS {
            self.pool.ledger.later = Some(later);
            let needed = LEDGER_BYTES + 4 * LIST_WORDS as u64;
            return Err(GpuError::TooLarge { what: "lists of a frame".to_owned(), needed, limit: LEDGER_BYTES });
        }
        later.noted.push(counted.list);
        let capacity = u32::try_from(capacity).unwrap_or(u32::MAX);
        let parameters = self.uniform(&NoteParameters { list: list as u32, capacity });
        let bindings = Bindings::new().part("note_parameters", &parameters).buffer("counted", counted.words);
        self.dispatch(&later.note, &bindings.buffer("ledger", &later.words), [1, 1, 1]);
        self.pool.ledger.later = Some(later);
        Ok(())
    }

    /// Where frames do not wait: what a draw of three vertices takes its numbers from, so that nothing is drawn where the frame is not
    /// whole. Word 1 is 1 where it is whole, word 4 the number of frames of a mean ([`Self::count_frame`]).
    pub fn whole(&self) -> Option<wgpu::Buffer> {
        self.pool.ledger.whole()
    }

    /// Where frames do not wait, counts this one among the frames of a mean if it is whole; the first of a mean begins anew.
    pub fn count_frame(&mut self, is_first: bool) {
        let Some(later) = self.pool.ledger.later.take() else { return };
        if is_first {
            self.encoder().clear_buffer(&later.words, 4 * FRAMES as u64, Some(4));
        }
        self.dispatch(&later.count_frame, &Bindings::new().buffer("ledger", &later.words), [1, 1, 1]);
        self.pool.ledger.later = Some(later);
    }
}

/// The sum of the lengths of parts, given their starts modulo 2³², the last being where the last part ends.
fn sum_of_parts(starts: &[u32]) -> u64 {
    starts.windows(2).map(|pair| u64::from(pair[1].wrapping_sub(pair[0]))).sum()
}

#[test]
fn a_sum_beyond_32_bits_is_added_up() {
    let counts = [u32::MAX, 7, 0, u32::MAX - 1, 12];
    let mut sum = 0u32;
    let mut starts = vec![0];
    starts.extend(counts.iter().map(|count| {
        sum = sum.wrapping_add(*count);
        sum
    }));
    assert_eq!(sum_of_parts(&starts), counts.iter().map(|count| u64::from(*count)).sum::<u64>());
}

#[test]
fn the_ledgers_words_are_the_shaders() {
    let shader = SHADERS.link("ledger/note", &[]).unwrap();
    crate::check_layout::<NoteParameters>(&shader).unwrap();
    let source = include_str!("note.wesl");
    for (name, value) in [("FRAMES", FRAMES), ("FIRST_LIST", FIRST_LIST), ("LIST_WORDS", LIST_WORDS)] {
        assert!(source.contains(&format!("const {name} = {value}u;")), "{name}");
    }
}
