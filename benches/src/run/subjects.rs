//! What `bench` measures: scenarios, and files of the user's own.

use crate::cli::BenchArgs;
use crate::scenario::{
    Measurement, Selection, batch, batch_gpu, chain, chunks, error_table, gpu, joints, joints_gpu,
    loops, meshes, model, needs, queries, scaling,
};
use std::path::Path;
use vertebra::assembly::urdf;
use vertebra::{Pose, TriangleMesh};

/// Everything that is measured.
pub(super) struct Subjects {
    pub(super) models: Vec<model::Subject>,
    needs: Vec<model::Subject>,
    lengths: Option<chunks::Subject>,
    joints: Option<joints::Subject>,
    batches: Vec<batch::Subject>,
    loops: Vec<loops::Subject>,
    gpu_batches: Option<batch_gpu::Subject>,
    pub(super) meshes: Vec<meshes::Subject>,
    queries: Option<queries::Subject>,
    error_lists: Vec<error_table::Subject>,
    spheres: Vec<scaling::Subject>,
    gpu: Option<gpu::Subject>,
    /// Whether rows of the CPU are wanted.
    on_cpu: bool,
    /// The GPU on which models are measured too.
    pub(super) device: Option<gpu::Subject>,
}

impl Subjects {
    /// What is asked for.
    pub(super) fn of(arguments: &BenchArgs) -> anyhow::Result<Self> {
        let selection = arguments.selection();
        Ok(Self {
            models: models(arguments)?,
            needs: if arguments.wants(needs::NAME) {
                needs::subjects(&selection)?
            } else {
                Vec::new()
            },
            lengths: if arguments.wants(chunks::NAME) {
                Some(chunks::Subject::new(arguments.seed)?)
            } else {
                None
            },
            joints: if arguments.wants(joints::NAME) {
                Some(joints::Subject::new(arguments.seed)?)
            } else {
                None
            },
            batches: if arguments.wants(batch::NAME) && arguments.wants_backend("cpu") {
                batch::subjects(&selection)?
            } else {
                Vec::new()
            },
            loops: if arguments.wants(loops::NAME) {
                loops::subjects(&selection)?
            } else {
                Vec::new()
            },
            gpu_batches: if arguments.wants(batch::NAME) && arguments.wants_backend("gpu") {
                batch_gpu::Subject::find(!arguments.backend.is_empty(), &selection)?
            } else {
                None
            },
            meshes: mesh_pairs(arguments)?,
            queries: if arguments.wants(queries::NAME) {
                Some(queries::Subject::new(&selection)?)
            } else {
                None
            },
            error_lists: if arguments.wants(error_table::NAME) {
                error_table::subjects(&selection)?
            } else {
                Vec::new()
            },
            spheres: if arguments.wants(scaling::NAME) {
                scaling::subjects(&selection)
            } else {
                Vec::new()
            },
            gpu: if arguments.wants(gpu::NAME) && arguments.wants_backend("gpu") {
                gpu::Subject::find(arguments.scenarios.iter().any(|name| name == gpu::NAME))?
            } else {
                None
            },
            on_cpu: arguments.wants_backend("cpu"),
            // Nothing but rows of models, mechanisms and meshes of one's own asks for it: drivers talk when they are opened.
            device: if arguments.wants_backend("gpu")
                && (arguments.wants(chain::NAME)
                    || arguments.wants(needs::NAME)
                    || arguments.wants(joints::NAME)
                    || arguments.wants(loops::NAME)
                    || arguments.model.is_some()
                    || arguments.hits.is_some())
            {
                gpu::Subject::find(!arguments.backend.is_empty())?
            } else {
                None
            },
        })
    }

    /// The rows asked for.
    pub(super) fn measurements(&self, selection: &Selection) -> Vec<Measurement<'_>> {
        let mut list = Vec::new();
        for subject in &self.models {
            if self.on_cpu {
                list.extend(subject.measurements(selection));
            }
            if let Some(gpu) = &self.device {
                list.extend(gpu::chains::measurements(subject, gpu.device(), selection));
            }
        }
        if self.on_cpu {
            list.extend(needs::measurements(&self.needs, selection));
        }
        if let Some(gpu) = &self.device {
            list.extend(needs::on_gpu(&self.needs, gpu.device(), selection));
        }
        if let Some(subject) = &self.lengths {
            list.extend(subject.measurements(selection));
        }
        if let Some(subject) = &self.joints {
            if self.on_cpu {
                list.extend(subject.measurements(selection));
            }
            if let Some(gpu) = &self.device {
                list.extend(joints_gpu::measurements(subject, gpu.device(), selection));
            }
        }
        for subject in &self.batches {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.loops {
            if self.on_cpu {
                list.extend(subject.measurements(selection));
            }
            if let Some(gpu) = &self.device {
                list.extend(gpu::loops::measurements(subject, gpu.device(), selection));
            }
        }
        if let Some(subject) = &self.gpu_batches {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.meshes {
            list.extend(subject.measurements(selection));
        }
        if let Some(subject) = &self.queries {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.error_lists {
            list.extend(subject.measurements(selection));
        }
        for subject in &self.spheres {
            list.extend(subject.measurements(selection));
        }
        if let Some(subject) = &self.gpu {
            list.extend(subject.measurements(selection));
        }
        list
    }
}

fn models(arguments: &BenchArgs) -> anyhow::Result<Vec<model::Subject>> {
    let mut subjects = Vec::new();
    if let Some(path) = &arguments.model {
        let mut options = urdf::Options::default();
        options.floating_base = arguments.floating_base;
        let robot = urdf::read(path, &options)?;
        print_robot(&robot);
        let name = format!("model {}", robot.model.name());
        // What is in its joints is left out: other programs' rows have none of it either.
        subjects.push(model::Subject::new(
            &name,
            robot.model.bare(),
            arguments.seed,
        ));
    }
    if arguments.wants(chain::NAME) {
        subjects.extend(chain::subjects(&arguments.selection())?);
    }
    Ok(subjects)
}

/// Says what was read, what of it has no effect, and what of it is doubtful.
fn print_robot(robot: &urdf::Robot) {
    let model = &robot.model;
    println!(
        "{}: {} bodies, {} degrees of freedom, {} named frames",
        model.name(),
        model.bodies().len(),
        model.dof_count(),
        model.frames().len()
    );
    for item in model.not_simulated() {
        println!("  {item}");
    }
    for item in &robot.ignored {
        println!("  {item}");
    }
    for item in &robot.doubtful {
        println!("  {item}");
    }
    let in_world = model.frames().iter().filter(|frame| frame.body.is_none());
    let fixed: Vec<&str> = in_world.map(|frame| frame.name.as_str()).collect();
    if !fixed.is_empty() {
        println!(
            "  fixed to the world, where their mass has no effect: {}",
            fixed.join(", ")
        );
    }
}

fn mesh_pairs(arguments: &BenchArgs) -> anyhow::Result<Vec<meshes::Subject>> {
    let mut subjects = Vec::new();
    if arguments.wants(meshes::NAME) {
        subjects.extend(meshes::subjects()?);
    }
    if let (Some(a), Some(b)) = (&arguments.mesh_a, &arguments.mesh_b) {
        subjects.push(meshes::Subject::new(
            &format!("{} x {}", file_stem(a), file_stem(b)),
            read_mesh(a)?,
            read_mesh(b)?,
            arguments.pose_b.unwrap_or(Pose::IDENTITY),
        ));
    }
    Ok(subjects)
}

fn read_mesh(path: &Path) -> anyhow::Result<TriangleMesh> {
    let mesh = TriangleMesh::read(path)?;
    let flat = mesh.zero_area();
    println!("{}: {} triangles", path.display(), mesh.len());
    if !flat.is_empty() {
        println!(
            "  {} of them have no area and are treated as the segments or points they are: {}{}",
            flat.len(),
            flat.iter()
                .take(8)
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(", "),
            if flat.len() > 8 { ", ..." } else { "" }
        );
    }
    Ok(mesh)
}

fn file_stem(path: &Path) -> String {
    path.file_stem().map_or_else(
        || "mesh".to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    )
}
