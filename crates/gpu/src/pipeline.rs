//! Compiling kernels.

use crate::device::Device;
use crate::error::Error;
use crate::kernel::{Access, Kernel};
use crate::loops::all_end;
use crate::reflect::differences;

/// A compiled kernel.
#[derive(Clone, Debug)]
pub(crate) struct Pipeline {
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) layout: wgpu::BindGroupLayout,
}

impl Pipeline {
    /// Compiles a kernel of a recording, unless its shader differs from what it declares.
    pub(crate) fn compile(
        device: &Device,
        recording: &str,
        kernel: &Kernel,
    ) -> Result<Self, Error> {
        let name = Some(kernel.name());
        let source = kernel.source();
        // One that does not parse is refused by wgpu, which says where.
        let parsed = naga::front::wgsl::parse_str(&source).ok();
        let problems = parsed.as_ref().map(|parsed| differences(kernel, parsed));
        if let Some(problems) = problems.filter(|problems| !problems.is_empty()) {
            return Err(Error::Recording {
                recording: recording.to_owned(),
                problems,
            });
        }
        let loops_end = parsed.is_some_and(|parsed| all_end(&parsed));
        let constants: Vec<_> = kernel.constants().collect();
        let entries: Vec<_> = (0..).zip(kernel.bindings()).map(entry).collect();
        let compiled = device.checked(kernel.name(), 0, |device, _| {
            let module = module(device, kernel.name(), source, loops_end);
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: name,
                entries: &entries,
            });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: name,
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: name,
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &constants,
                    // Kernels set what they read of it.
                    zero_initialize_workgroup_memory: false,
                },
                cache: None,
            });
            Self { pipeline, layout }
        });
        compiled.map_err(|error| match error {
            Error::Driver { message, .. } => Error::Shader {
                kernel: kernel.name().to_owned(),
                message,
            },
            other => other,
        })
    }
}

/// The shader, without counting the rounds of loops where they are seen to end.
#[expect(
    unsafe_code,
    reason = "wgpu leaves out checks by an unsafe function only"
)]
fn module(
    device: &wgpu::Device,
    name: &str,
    source: String,
    loops_end: bool,
) -> wgpu::ShaderModule {
    let descriptor = wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    };
    let checks = wgpu::ShaderRuntimeChecks {
        force_loop_bounding: !loops_end,
        ..wgpu::ShaderRuntimeChecks::checked()
    };
    // SAFETY: all other checks are made, and this one is left out only of a shader that has no
    // infinite loop, which is what wgpu asks for.
    unsafe { device.create_shader_module_trusted(descriptor, checks) }
}

fn entry((number, binding): (u32, &crate::kernel::Binding)) -> wgpu::BindGroupLayoutEntry {
    let ty = match binding.access {
        Access::Uniform => wgpu::BufferBindingType::Uniform,
        Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
        Access::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
    };
    wgpu::BindGroupLayoutEntry {
        binding: number,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: wgpu::BufferSize::new(binding.stride.into()),
        },
        count: None,
    }
}
