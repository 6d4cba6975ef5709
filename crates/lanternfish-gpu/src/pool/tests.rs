use super::{KEPT_FRAMES, Pool};
use crate::{
    Bindings, ComputeKernel, Frame, Gpu, PassCommands, Profiler, made, primitives::SHADERS, read_back, testing,
};

const TEXTURE: wgpu::TextureDescriptor<'_> = wgpu::TextureDescriptor {
    label: Some("texture"),
    size: wgpu::Extent3d { width: 4, height: 4, depth_or_array_layers: 1 },
    mip_level_count: 1,
    sample_count: 1,
    dimension: wgpu::TextureDimension::D2,
    format: wgpu::TextureFormat::R32Float,
    usage: wgpu::TextureUsages::TEXTURE_BINDING,
    view_formats: &[],
};

/// Frames of one pool.
struct Frames<'g> {
    gpu: &'g Gpu,
    profiler: Profiler,
    pool: Pool,
}

impl<'g> Frames<'g> {
    fn new(gpu: &'g Gpu) -> Self {
        Self { gpu, profiler: Profiler::new(&gpu.device, &gpu.queue), pool: Pool::new(&gpu.device) }
    }

    fn next(&mut self) -> Frame<'_> {
        Frame::pooled(&self.gpu.device, &self.gpu.queue, &mut self.profiler, &mut self.pool)
    }

    fn read(&self, buffer: &wgpu::Buffer) -> u32 {
        read_back::<u32>(&self.gpu.device, &self.gpu.queue, buffer, 1).unwrap()[0]
    }
}

/// Writes 7 to the first word of a buffer.
fn write(frame: &mut Frame<'_>, buffer: &wgpu::Buffer) {
    let seven = frame.storage_of("seven", &[7u32]).unwrap();
    frame.encoder().copy_buffer_to_buffer(&seven, 0, buffer, 0, 4);
}

#[gpu_test]
fn gpu_zeroed_buffers_are_zero_in_every_frame(gpu: &Gpu) {
    let mut frames = Frames::new(gpu);
    let mut buffers = Vec::new();
    for number in 0..3 {
        let mut frame = frames.next();
        let [zeroed, scratch] = [frame.zeroed("zeroed", 100).unwrap(), frame.scratch("scratch", 100).unwrap()];
        let initial = frame.scratch("initial", 4).unwrap();
        frame.encoder().copy_buffer_to_buffer(&zeroed, 0, &initial, 0, 4);
        write(&mut frame, &zeroed);
        write(&mut frame, &scratch);
        frame.submit();
        assert_eq!((frames.read(&initial), frames.read(&zeroed), frames.read(&scratch)), (0, 7, 7), "{number}");
        buffers.push([zeroed, scratch]);
    }
    assert!(buffers.windows(2).all(|pair| pair[0] == pair[1]), "the buffers were not reused");
    // Commands that are never submitted clear nothing; the next frame clears.
    drop(frames.next());
    let mut frame = frames.next();
    let zeroed = frame.zeroed("zeroed", 100).unwrap();
    frame.submit();
    assert_eq!(zeroed, buffers[0][0]);
    assert_eq!(frames.read(&zeroed), 0);
    // The check can fail: a scratch buffer is not cleared.
    assert_eq!(frames.read(&buffers[0][1]), 7);
}

#[gpu_test]
fn gpu_what_is_released_is_used_again_in_its_frame(gpu: &Gpu) {
    let mut frames = Frames::new(gpu);
    for number in 0..2 {
        let mut frame = frames.next();
        let first = frame.scratch("scratch", 1000).unwrap();
        write(&mut frame, &first);
        frame.release(&first);
        let again = frame.scratch("scratch", 1000).unwrap();
        assert_eq!(first, again, "{number}");
        assert_ne!(first, frame.scratch("scratch", 1000).unwrap(), "{number}");
        // What the host writes precedes all passes, so that such a buffer is another one.
        frame.release(&again);
        assert_ne!(first, frame.storage_of("scratch", &[0u32; 250]).unwrap(), "{number}");
        let textures = [frame.texture(&TEXTURE), frame.texture(&TEXTURE)];
        frame.release_texture(&textures[0]);
        let [again, third] = [frame.texture(&TEXTURE), frame.texture(&TEXTURE)];
        assert!(again == textures[0] && !textures.contains(&third), "{number}");
        frame.submit();
    }
}

#[gpu_test]
fn gpu_requests_of_a_frame_do_not_alias_and_the_next_frame_reuses_them(gpu: &Gpu) {
    let mut frames = Frames::new(gpu);
    let mut evaluate = |bytes: u64| {
        let before = made();
        let mut frame = frames.next();
        let buffers = [(); 2].map(|()| frame.scratch("list", bytes).unwrap());
        let textures = [(); 2].map(|()| frame.texture(&TEXTURE));
        frame.submit();
        assert!(buffers[0] != buffers[1] && textures[0] != textures[1]);
        (made() - before, frames.pool.bytes(), buffers)
    };
    let (first, bytes, buffers) = evaluate(1000);
    assert_eq!((first.buffers, first.textures), (2, 2));
    assert_eq!(bytes, 2 * 1008_u64.next_multiple_of(64) + 2 * 64);
    // A slightly smaller or larger request reuses the buffers too.
    for other in [1000, 900, 1020] {
        let (again, _, others) = evaluate(other);
        assert_eq!((again.buffers, again.textures, &others), (0, 0, &buffers), "{other}");
    }
    // A much larger request does not; the small buffers are dropped after a few frames.
    let (grown, both, _) = evaluate(4000);
    assert_eq!((grown.buffers, grown.textures), (2, 0));
    let after: Vec<u64> = (0..=KEPT_FRAMES).map(|_| evaluate(4000).1).collect();
    assert_eq!(after[0], both);
    assert!(*after.last().unwrap() == both - (bytes - 2 * 64), "{after:?} of {both}");
}

/// A list whose length varies keeps the buffer that is long enough for every length, however rare that is.
#[gpu_test]
fn gpu_lists_of_varying_length_keep_one_buffer(gpu: &Gpu) {
    let mut frames = Frames::new(gpu);
    let mut evaluate = |bytes: u64| {
        let before = made();
        let mut frame = frames.next();
        frame.scratch("list", bytes).unwrap();
        frame.submit();
        (made() - before).buffers
    };
    let long_and_short = |number: u64| if number.is_multiple_of(2 * KEPT_FRAMES) { 7712 } else { 7648 };
    assert_eq!((evaluate(7648), evaluate(7712)), (1, 1));
    for number in 1..5 * KEPT_FRAMES {
        assert_eq!(evaluate(long_and_short(number)), 0, "{number}");
    }
}

#[gpu_test]
fn gpu_uniforms_before_and_after_a_readback_do_not_overlap(gpu: &Gpu) {
    let mut frames = Frames::new(gpu);
    // A scan with its parameters in a uniform. With a count of 0 it leaves the value unchanged.
    let shader = SHADERS.link("primitives/scan/scan", &[]).unwrap();
    let kernel = ComputeKernel::new(&gpu.device, &shader, "scan_blocks", "test");
    for number in 0..3 {
        let before = made();
        let mut frame = frames.next();
        let [values, totals] = [(); 2].map(|()| frame.scratch("values", 64).unwrap());
        let record = |frame: &mut Frame<'_>, count: u32| {
            write(frame, &values);
            let parameters = frame.uniform(&[count, 1, 0, 0]);
            let bindings = Bindings::new().part("scan_parameters", &parameters).buffer("scan_values", &values);
            frame.dispatch(&kernel, &bindings.buffer("scan_totals", &totals), [1, 1, 1]);
        };
        record(&mut frame, 0);
        let kept = frame.read_now::<u32>(&values, 1).unwrap()[0];
        record(&mut frame, 1);
        frame.submit();
        assert_eq!((kept, frames.read(&values), frames.read(&totals)), (7, 0, 7), "{number}");
        assert_eq!(frames.pool.waits(), number + 1);
        let made = made() - before;
        // The test's own two readbacks create buffers.
        assert!(number == 0 || (made.buffers, made.bind_groups) == (2, 0), "{number}: {made:?}");
    }
}

/// Commands are counted by label, also those before a readback; commands that are never submitted are not.
#[gpu_test]
fn gpu_commands_of_a_frame_are_counted_by_label(gpu: &Gpu) {
    let mut frames = Frames::new(gpu);
    let shader = SHADERS.link("primitives/scan/scan", &[]).unwrap();
    let kernel = |label: &str| ComputeKernel::new(&gpu.device, &shader, "scan_blocks", label);
    let kernels = ["first", "second"].map(kernel);
    let record = |frame: &mut Frame<'_>, order: &[usize], is_indirect: bool| {
        let [values, totals] = [(); 2].map(|()| frame.zeroed("values", 64).unwrap());
        let (parameters, groups) = (frame.uniform(&[1, 1, 0, 0]), frame.zeroed("groups", 16).unwrap());
        frame.encoder().clear_buffer(&groups, 0, None);
        let bindings = Bindings::new().part("scan_parameters", &parameters).buffer("scan_values", &values);
        let bindings = bindings.buffer("scan_totals", &totals);
        for index in order {
            match is_indirect {
                true => frame.dispatch_indirect(&kernels[*index], &bindings, &groups, 0),
                false => frame.dispatch(&kernels[*index], &bindings, [1; 3]),
            }
        }
        values
    };
    let mut frame = frames.next();
    record(&mut frame, &[0, 0, 1], false);
    drop(frame);
    let mut frame = frames.next();
    let values = record(&mut frame, &[1, 0, 1], false);
    frame.read_now::<u32>(&values, 1).unwrap();
    record(&mut frame, &[1, 1, 0], true);
    let target = frame.texture(&wgpu::TextureDescriptor { usage: wgpu::TextureUsages::RENDER_ATTACHMENT, ..TEXTURE });
    let color = wgpu::RenderPassColorAttachment {
        view: &target,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations::default(),
    };
    frame.render("render", &[Some(color)], None, |_, _| ());
    let number = frame.number();
    frame.submit();
    let of = |pass: PassCommands| (pass.name, pass.dispatches, pass.indirect);
    let counted: Vec<_> = frames.profiler.commands_of(number).into_iter().map(of).collect();
    let expected = [("second", 4, 2), ("first", 2, 1), ("render", 0, 0)];
    assert_eq!(counted, expected.map(|(name, dispatches, indirect)| (name.to_owned(), dispatches, indirect)));
    assert!(frames.profiler.commands_of(number).is_empty(), "they are taken once");
}
