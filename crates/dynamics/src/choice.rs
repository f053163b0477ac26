//! Which algorithm on which device, and why.

#[cfg(feature = "gpu")]
use crate::Error;
use crate::dca::PARALLEL_BODIES;
use crate::{Algorithm, Precision, SolverOptions, cost};
use core::fmt;
#[cfg(feature = "gpu")]
use vertebra_assembly::Model;

/// What a [`Solver`](crate::Solver) or a [`Simulation`](crate::Simulation) has picked, and why: printed, a sentence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The algorithm.
    pub algorithm: Algorithm,
    /// Whether it was asked for.
    pub forced: bool,
    /// Precision of the bodies' own computations.
    pub precision: Precision,
    /// Precision of the joins, if there are any.
    pub tree: Precision,
    /// Threads that divide and conquer uses, or would use.
    pub threads: usize,
    /// Expected time of the articulated-body algorithm \[s\].
    pub aba_s: f64,
    /// Expected time of divide and conquer \[s\].
    pub dca_s: f64,
    /// Whether it runs on a GPU.
    pub on_gpu: bool,
    /// Expected time of a step on the GPU \[s\], if there was one to choose.
    pub gpu_s: Option<f64>,
}

impl Choice {
    /// What the processor is expected to take.
    pub(crate) fn on_host(bodies: usize, options: &SolverOptions) -> Self {
        let threads = threads(options.parallel, bodies);
        let with_sweeps = |algorithm, solve| solve * cost::corrected(algorithm, options.sweeps);
        let aba_s = cost::aba(bodies, options.precision);
        let aba_s = with_sweeps(Algorithm::Aba, aba_s);
        let dca_s = cost::dca(bodies, rounds(bodies), threads, options.precision);
        let dca_s = with_sweeps(Algorithm::Dca, dca_s);
        let faster = if dca_s < aba_s {
            Algorithm::Dca
        } else {
            Algorithm::Aba
        };
        Self {
            algorithm: options.algorithm.unwrap_or(faster),
            forced: options.algorithm.is_some(),
            precision: options.precision,
            tree: options.tree.unwrap_or(options.precision),
            threads,
            aba_s,
            dca_s,
            on_gpu: false,
            gpu_s: None,
        }
    }

    /// What the processor is expected to take, and this GPU; `on_gpu` says which less. A driver that plays
    /// a GPU on the processor takes more than the processor itself.
    #[cfg(feature = "gpu")]
    pub(crate) fn with_gpu(
        model: &Model,
        device: &vertebra_gpu::Device,
        options: &crate::gpu::Options,
    ) -> Result<Self, Error> {
        let bodies = model.bodies().len();
        let (chunks, tree) = options.precisions(device)?;
        let on_host = SolverOptions {
            sweeps: options.sweeps,
            ..SolverOptions::default()
        };
        let host = Self::on_host(bodies, &on_host);
        let gpu_s = cost::gpu_refined_step(bodies, chunks, tree, options.sweeps);
        let is_real = device.info().device_type != vertebra_gpu::wgpu::DeviceType::Cpu;
        // Elements cost about as many times more on both: springs and dampers 1.1 on an H100 and 1.3 on a Xeon, with
        // friction and stops 4.2 and 4.4. Every mechanism with loops that was measured is faster on the processor.
        let open = !crate::loops::has_loops(model);
        Ok(Self {
            on_gpu: is_real && open && gpu_s < host.aba_s.min(host.dca_s),
            gpu_s: Some(gpu_s),
            ..host
        })
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            algorithm,
            precision,
            tree,
            threads,
            ..
        } = self;
        write!(f, "{algorithm} in {precision}")?;
        if *algorithm == Algorithm::Dca && tree != precision {
            write!(f, " over a tree in {tree}")?;
        }
        if self.on_gpu {
            f.write_str(" on the GPU")?;
        }
        let why = if self.forced {
            "as asked"
        } else {
            "expected to be faster"
        };
        write!(
            f,
            ", {why}: aba {:.3} ms, dca on {threads} thread{} {:.3} ms",
            1e3 * self.aba_s,
            if *threads == 1 { "" } else { "s" },
            1e3 * self.dca_s
        )?;
        let Some(gpu_s) = self.gpu_s else {
            return Ok(());
        };
        write!(f, ", a step on the GPU {:.3} ms", 1e3 * gpu_s)?;
        if !self.on_gpu && gpu_s < self.aba_s.min(self.dca_s) {
            f.write_str(" on hardware, of models without loops that it computes all of")?;
        }
        Ok(())
    }
}

/// Rounds of an assembly tree of so many bodies: two for each halving, as in the worst of trees.
pub(crate) fn rounds(bodies: usize) -> usize {
    2 * bodies.max(1).ilog2() as usize
}

/// Threads there are for so many bodies; asking rayon would start them.
fn threads(parallel: bool, bodies: usize) -> usize {
    if !parallel || bodies < PARALLEL_BODIES {
        return 1;
    }
    #[cfg(feature = "rayon")]
    let threads = rayon::current_num_threads();
    #[cfg(not(feature = "rayon"))]
    let threads = 1;
    threads
}
