//! Dependent dispatches written against wgpu alone: what a recording is compared with.

use crate::suite::gpu::runtime::STEP;
use anyhow::Context;
use std::time::Instant;
use vertebra_gpu::Device;
use vertebra_gpu::wgpu;

/// Twenty dispatches of [`STEP`] on one buffer.
pub(super) struct Bare<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    data: wgpu::Buffer,
    times: Option<Times>,
}

struct Times {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl<'a> Bare<'a> {
    pub(super) fn new(device: &'a Device, words: u64, timed: bool) -> Self {
        let (device, queue) = device.raw();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(STEP.source().into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let buffer = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let data = buffer(
            4 * words,
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        );
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: data.as_entire_binding(),
            }],
        });
        let (resolve, read) = (
            wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        );
        let times = timed.then(|| Times {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(16, resolve),
            read: buffer(16, read),
        });
        Self {
            device,
            queue,
            pipeline,
            bindings,
            data,
            times,
        }
    }

    /// What the dispatches until now have made of zeros.
    pub(super) fn result(&self) -> anyhow::Result<Vec<u32>> {
        let read = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: self.data.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.data, 0, &read, 0, self.data.size());
        self.queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        let view = read.get_mapped_range(..)?;
        Ok(bytemuck::pod_collect_to_vec(&view))
    }

    /// Time on the device where timed, else of submitting and waiting \[s\].
    pub(super) fn run(&self, dispatches: usize) -> anyhow::Result<f64> {
        let start = Instant::now();
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let times = self.times.as_ref();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: None,
            timestamp_writes: times.map(|times| wgpu::ComputePassTimestampWrites {
                query_set: &times.queries,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: Some(1),
            }),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        for _ in 0..dispatches {
            pass.dispatch_workgroups(1, 1, 1);
        }
        drop(pass);
        if let Some(times) = times {
            encoder.resolve_query_set(&times.queries, 0..2, &times.resolved, 0);
            encoder.copy_buffer_to_buffer(&times.resolved, 0, &times.read, 0, 16);
        }
        self.queue.submit([encoder.finish()]);
        let Some(times) = times else {
            self.device.poll(wgpu::PollType::wait_indefinitely())?;
            return Ok(start.elapsed().as_secs_f64());
        };
        times.read.map_async(wgpu::MapMode::Read, .., |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        let view = times.read.get_mapped_range(..)?;
        let tick = |at: usize| {
            let bytes = view.get(at..at + 8).and_then(|bytes| bytes.try_into().ok());
            bytes.map(u64::from_le_bytes).context("no timestamp")
        };
        let ticks = tick(8)?.saturating_sub(tick(0)?);
        drop(view);
        times.read.unmap();
        Ok(ticks as f64 * f64::from(self.queue.get_timestamp_period()) * 1e-9)
    }
}
