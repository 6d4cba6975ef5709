//! Frames as slices: one command buffer for each pass, in several submissions.

use super::*;

/// Frames in slices, with other work of the device between them, equal frames of one submission: image, counters and the labels of times.
#[gpu_test]
fn gpu_slices_are_the_frame_to_the_bit(gpu: &Gpu) {
    let scene = lit();
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let direct = bvh(Settings::direct_light());
    for settings in [
        direct.clone().with_samples(Samples::Four).with_accumulate(3),
        one_bounce().with_accumulate(3),
        direct.with_debug_view(Some(DebugView::Normal)).with_exposure(Exposure::Ev(0.0)),
    ] {
        let mut whole = Renderer::with_engine(&testing::engine(gpu), settings.clone()).unwrap();
        let mut sliced = Renderer::with_engine(whole.engine(), settings).unwrap();
        let uploaded = whole.upload(&scene).unwrap();
        let shown = [(); 2].map(|()| texture(gpu, format, SIZE));
        let other = storage_buffer(&gpu.device, "other", 256).unwrap();
        for step in 0..4 {
            // Two frames of a mean, then the camera moves.
            let camera = camera(&scene, step / 2);
            let requests =
                [0, 1].map(|i| [ViewRequest::of_camera(0, &camera, SIZE, Target::Display(&shown[i], format))]);
            let id = frame(gpu, &mut whole, &uploaded, &requests[0]).unwrap();
            let expected = report(gpu, &mut whole, id);
            let (id, slices) = sliced.record_slices(&uploaded, &requests[1]).unwrap();
            assert!(slices.len() > 4, "{} slices", slices.len());
            assert!(matches!(sliced.record_slices(&uploaded, &requests[1]), Err(RenderError::NotSubmitted)));
            for (index, slice) in slices.into_iter().enumerate() {
                gpu.queue.submit([slice]);
                // A paint of the window.
                let mut between = gpu.device.create_command_encoder(&Default::default());
                between.clear_buffer(&other, 0, None);
                gpu.queue.submit([between.finish()]);
                if index % 3 == 0 {
                    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
                    assert!(sliced.poll().is_none(), "reported before its last slice");
                }
            }
            let id = sliced.submitted(id);
            let report = report(gpu, &mut sliced, id);
            assert_eq!((report.is_complete, &report.counters), (expected.is_complete, &expected.counters));
            let labels = |report: &FrameReport| report.passes.iter().map(|pass| pass.name.clone()).collect::<Vec<_>>();
            assert_eq!(labels(&report), labels(&expected));
            assert!(bytes(gpu, &shown[0]) == bytes(gpu, &shown[1]), "step {step}");
        }
        let is_black = bytes(gpu, &shown[0]).iter().all(|texel| texel[..3] == [0; 3]);
        assert!(!is_black, "no frame was complete");
    }
}

/// A frame whose last slices are dropped is followed by frames like the first.
#[gpu_test]
fn gpu_a_frame_may_be_dropped_between_its_slices(gpu: &Gpu) {
    let scene = lit();
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let mut renderer = Renderer::with_engine(&testing::engine(gpu), one_bounce()).unwrap();
    let uploaded = renderer.upload(&scene).unwrap();
    let shown = texture(gpu, format, SIZE);
    let camera = camera(&scene, 0);
    let request = [ViewRequest::of_camera(0, &camera, SIZE, Target::Display(&shown, format))];
    renderer.ready(&uploaded, &request).unwrap();
    let id = frame(gpu, &mut renderer, &uploaded, &request).unwrap();
    assert!(report(gpu, &mut renderer, id).is_complete);
    let expected = bytes(gpu, &shown);
    for submitted in [1, 7, 20] {
        let (id, mut slices) = renderer.record_slices(&uploaded, &request).unwrap();
        slices.truncate(submitted);
        gpu.queue.submit(slices);
        drop(id);
        assert!(bytes(gpu, &shown) == expected, "the last complete image stays");
        let id = frame(gpu, &mut renderer, &uploaded, &request).unwrap();
        assert!(report(gpu, &mut renderer, id).is_complete);
        assert!(bytes(gpu, &shown) == expected, "after {submitted} slices");
    }
}
