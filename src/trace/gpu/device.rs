//! The only file that uses `wgpu`: an adapter, buffers in its memory, and the two shaders.

use std::fmt::Display;
use std::future::Future;
use std::pin::pin;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, OnceLock};
use std::task::{Context, Poll, Waker};

use wgpu::BufferUsages as Usage;

use super::error::GpuError;
use super::packed::{Aim, Corners, Node, Spot};

/// Invocations per workgroup, as in the shaders.
const WORKGROUP: u64 = 64;

/// An adapter, ready to trace.
pub(super) struct Device {
    device: wgpu::Device,
    queue: wgpu::Queue,
    closest: wgpu::ComputePipeline,
    echo: wgpu::ComputePipeline,
    adapter: String,
    /// Size of the largest buffer, bytes.
    most: u64,
    /// The first error that was reported asynchronously.
    trouble: Arc<OnceLock<String>>,
}

/// A hierarchy in the device's memory.
pub(super) struct Tree {
    nodes: wgpu::Buffer,
    corners: wgpu::Buffer,
}

/// The scattering models on a tree and the samples of a spot, in the device's memory.
pub(super) struct Table {
    places: wgpu::Buffer,
    samples: wgpu::Buffer,
    laws: wgpu::Buffer,
    terms: wgpu::Buffer,
}

/// A launched computation.
pub(super) struct Flight {
    submission: wgpu::SubmissionIndex,
    answers: wgpu::Buffer,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Device {
    /// Opens the fastest kind of adapter, with buffers of at most `most` bytes.
    pub fn open(most: u64) -> Result<Device, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            flags: wgpu::InstanceFlags::empty(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let no_adapter = |reason: &dyn Display| GpuError::NoAdapter { reason: single_line(reason) };
        let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        }))
        .map_err(|reason| no_adapter(&reason))?;
        let limits = adapter.limits();
        let most = most.min(limits.max_buffer_size).min(limits.max_storage_buffer_binding_size);
        let (device, queue) = block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: limits,
            ..Default::default()
        }))
        .map_err(|reason| no_adapter(&reason))?;
        let trouble = Arc::new(OnceLock::new());
        let note = |trouble: &Arc<OnceLock<String>>| {
            let trouble = trouble.clone();
            // Errors that follow from the first one are less informative and dropped.
            move |reason: &dyn Display| drop(trouble.set(single_line(reason)))
        };
        let (failed, lost) = (note(&trouble), note(&trouble));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| failed(&error)));
        device.set_device_lost_callback(move |_, reason| lost(&reason));
        let shaders = concat!(include_str!("closest.wgsl"), include_str!("echo.wgsl"));
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(shaders.into()),
        });
        let [closest, echo] = ["closest", "echo"].map(|entry_point| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: None,
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                cache: None,
            })
        });
        let adapter = adapter.get_info().name;
        let device = Device { device, queue, closest, echo, adapter, most, trouble };
        device.check_trouble().map(|()| device)
    }

    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Number of rays per call, at most `most`.
    pub fn rays_at_once(&self, most: u64) -> usize {
        self.fitting(most, size_of::<Aim>() as u64, 1)
    }

    /// Number of chirps per call, at most `most`, with `shares` shares each.
    pub fn spots_at_once(&self, most: u64, shares: u64) -> usize {
        let bytes = (size_of::<Spot>() as u64).max(shares * size_of::<[u32; 5]>() as u64);
        self.fitting(most, bytes, shares)
    }

    /// Number of items per call, at most `most`, if each needs `bytes` in a buffer and `invocations`.
    fn fitting(&self, most: u64, bytes: u64, invocations: u64) -> usize {
        let groups = u64::from(self.device.limits().max_compute_workgroups_per_dimension);
        let fit = (self.most / bytes).min(WORKGROUP * groups / invocations);
        most.min(fit).max(1) as usize
    }

    /// Copies a hierarchy to the device.
    pub fn hold(&self, nodes: &[Node], corners: &[Corners]) -> Result<Tree, GpuError> {
        let [nodes, corners]: [&[u8]; 2] =
            [bytemuck::cast_slice(nodes), bytemuck::cast_slice(corners)];
        let needed = nodes.len().max(corners.len()) as u64;
        if needed > self.most {
            let (adapter, most) = (self.adapter.clone(), self.most);
            return Err(GpuError::TooLarge { adapter, needed, most });
        }
        let tree = Tree { nodes: self.filled(nodes)?, corners: self.filled(corners)? };
        self.check_trouble().map(|()| tree)
    }

    /// Copies the region of each leaf entry, the samples of a spot, and the scattering models with their terms.
    pub fn table(
        &self,
        places: &[[u32; 2]],
        samples: &[[f32; 2]],
        laws: &[[u32; 2]],
        terms: &[[u32; 4]],
    ) -> Result<Table, GpuError> {
        let parts: [&[u8]; 4] = [
            bytemuck::cast_slice(places),
            bytemuck::cast_slice(samples),
            bytemuck::cast_slice(laws),
            bytemuck::cast_slice(terms),
        ];
        let needed = parts.iter().map(|part| part.len() as u64).fold(0, u64::max);
        if needed > self.most {
            let (adapter, most) = (self.adapter.clone(), self.most);
            return Err(GpuError::TooMany { adapter, needed, most });
        }
        let [places, samples, laws, terms] = parts.map(|part| self.filled(part));
        let table = Table { places: places?, samples: samples?, laws: laws?, terms: terms? };
        self.check_trouble().map(|()| table)
    }

    /// Launches the search for the closest facets: one word per ray.
    pub fn launch(&self, tree: &Tree, aims: &[Aim]) -> Result<Flight, GpuError> {
        let rays = self.filled(bytemuck::cast_slice(aims))?;
        let given = [(0, &tree.nodes), (1, &tree.corners), (2, &rays)];
        self.start(&self.closest, &given, aims.len() as u64, 1)
    }

    /// Launches the sums of echoes: five words per share of each chirp.
    pub fn launch_echoes(
        &self,
        tree: &Tree,
        table: &Table,
        spots: &[Spot],
        shares: u64,
    ) -> Result<Flight, GpuError> {
        let chirps = self.filled(bytemuck::cast_slice(spots))?;
        let given = [
            (0, &tree.nodes),
            (1, &tree.corners),
            (4, &table.places),
            (5, &chirps),
            (6, &table.samples),
            (7, &table.laws),
            (8, &table.terms),
        ];
        self.start(&self.echo, &given, spots.len() as u64 * shares, 5)
    }

    /// Launches `invocations` of a shader that write `words` each.
    fn start(
        &self,
        pipeline: &wgpu::ComputePipeline,
        given: &[(u32, &wgpu::Buffer)],
        invocations: u64,
        words: u64,
    ) -> Result<Flight, GpuError> {
        /// Binding of the buffer that the shaders write.
        const ANSWERS: u32 = 3;
        let bytes = invocations * words * size_of::<u32>() as u64;
        let found = self.buffer(bytes, Usage::STORAGE | Usage::COPY_SRC)?;
        let answers = self.buffer(bytes, Usage::MAP_READ | Usage::COPY_DST)?;
        let entries: Vec<_> = given
            .iter()
            .chain(&[(ANSWERS, &found)])
            .map(|&(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(invocations.div_ceil(WORKGROUP) as u32, 1, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&found, 0, &answers, 0, bytes);
        let submission = self.queue.submit([encoder.finish()]);
        let (sender, mapped) = channel();
        // Sending fails if the receiver was dropped because a later call failed.
        answers.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        self.check_trouble()?;
        Ok(Flight { submission, answers, mapped })
    }

    /// Waits for a computation and returns its words.
    pub fn land(&self, flight: Flight) -> Result<Vec<u32>, GpuError> {
        let Flight { submission, answers, mapped } = flight;
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
        let polled = self.device.poll(wait);
        self.check_trouble()?;
        polled.map_err(|reason| self.lost(&reason))?;
        match mapped.try_recv() {
            Ok(Ok(())) => {}
            Ok(Err(reason)) => return Err(self.lost(&reason)),
            Err(reason) => return Err(self.lost(&reason)),
        }
        let view = answers.get_mapped_range(..).map_err(|reason| self.lost(&reason))?;
        Ok(bytemuck::pod_collect_to_vec(&view[..]))
    }

    /// A storage buffer with these contents.
    fn filled(&self, bytes: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.buffer(bytes.len() as u64, Usage::STORAGE | Usage::COPY_DST)?;
        self.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    }

    fn buffer(&self, bytes: u64, usage: Usage) -> Result<wgpu::Buffer, GpuError> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage,
            mapped_at_creation: false,
        });
        match block_on(scope.pop()) {
            None => Ok(buffer),
            Some(_) => Err(GpuError::Full { adapter: self.adapter.clone(), needed: bytes }),
        }
    }

    /// Fails if an error was reported asynchronously.
    fn check_trouble(&self) -> Result<(), GpuError> {
        self.trouble.get().map_or(Ok(()), |reason| Err(self.lost(reason)))
    }

    fn lost(&self, reason: &dyn Display) -> GpuError {
        GpuError::Lost { adapter: self.adapter.clone(), reason: single_line(reason) }
    }
}

/// Runs a future to its end. The futures of native drivers are ready at once.
fn block_on<F: Future>(future: F) -> F::Output {
    let (mut future, mut context) = (pin!(future), Context::from_waker(Waker::noop()));
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return output;
        }
        std::thread::yield_now();
    }
}

/// A message in a single line.
fn single_line(reason: &dyn Display) -> String {
    let text = reason.to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Point, Ray};
    use crate::scene::solids;
    use crate::trace::gpu::tests::gpu;
    use crate::trace::{Bvh, TraceError, Tracer};

    fn device() -> Option<Device> {
        gpu(u64::MAX).map(|gpu| gpu.device)
    }

    fn lost(error: GpuError) {
        let text = error.to_string();
        assert!(matches!(error, GpuError::Lost { .. }) && text.lines().count() == 1, "{text}");
        assert!(text.ends_with("try again, or use the tracer `bvh`"), "{text}");
    }

    /// A box without content.
    const EMPTY: Node = [0, 0, 0, 1, 0, 0, 0, 0];
    const POINT: Corners = [[0.0; 4]; 3];

    #[test]
    fn a_device_that_is_lost_is_an_error_and_no_panic() {
        let Some(device) = device() else { return };
        let tree = device.hold(&[EMPTY], &[POINT]).unwrap();
        let answers = device.land(device.launch(&tree, &[[7; 8], [9; 8]]).unwrap()).unwrap();
        assert_eq!(answers, [7, 9], "what is known is not asked");
        let table = device.table(&[[0, 0]], &[[0.0; 2]], &[[0; 2]], &[[0; 4]]).unwrap();
        let spots = [[u32::MAX; 24]];
        let echoes = device.launch_echoes(&tree, &table, &spots, 1).unwrap();
        assert_eq!(
            device.land(echoes).unwrap(),
            [0, 0, 0, 0, u32::MAX],
            "what is known is not asked"
        );
        let flight = device.launch(&tree, &[[7; 8]]).unwrap();
        device.device.destroy();
        // What was under way may still arrive.
        device.land(flight).map_or_else(lost, |answers| assert_eq!(answers, [7]));
        lost(device.launch(&tree, &[[7; 8]]).err().unwrap());
        lost(device.launch_echoes(&tree, &table, &spots, 1).err().unwrap());
        lost(device.table(&[[0, 0]], &[[0.0; 2]], &[[0; 2]], &[[0; 4]]).err().unwrap());
        lost(device.hold(&[EMPTY], &[POINT]).err().unwrap());
    }

    #[test]
    fn a_device_that_is_lost_between_turns_gives_an_error_and_no_hits() {
        // So small that the rays take turns.
        let Some(gpu) = gpu(4096) else { return };
        let ball = solids::icosphere(0.5, 0);
        let bvh = Bvh::new(&ball);
        let held = gpu.hold(&bvh).unwrap();
        let origin = Point::new(0.0, 0.0, 8.0);
        let aim = |i: usize| Point::new(1e-3 * i as f64 - 0.5, 0.1, 0.0);
        let ray = |i| Ray { origin, direction: origin.towards(aim(i)).unwrap() };
        let rays: Vec<_> = (0..1000).map(ray).collect();
        assert!(3 * gpu.device.rays_at_once(u64::MAX) < rays.len());
        let expected = Tracer::Bvh.closest(&bvh, &rays).unwrap();
        assert_eq!(Tracer::Gpu(&held).closest(&bvh, &rays).unwrap(), expected);
        // While the first answers are seen to, the next are under way and others are still to come.
        let broken = held.map_answers(&rays, |_, answer| {
            gpu.device.device.destroy();
            answer
        });
        lost(broken.unwrap_err());
        match Tracer::Gpu(&held).closest(&bvh, &rays) {
            Err(TraceError::Gpu(error)) => lost(error),
            other => panic!("{other:?}"),
        }
        assert_eq!(Tracer::Bvh.closest(&bvh, &rays).unwrap(), expected, "the hierarchy stays");
    }

    #[test]
    fn memory_that_is_not_there_is_an_error_and_no_panic() {
        let Some(device) = device() else { return };
        let most = device.device.limits().max_buffer_size;
        match device.buffer(most, Usage::STORAGE) {
            Err(GpuError::Full { needed, .. }) => assert_eq!(needed, most),
            Err(other) => panic!("{other}"),
            Ok(_) => {}
        }
    }
}
