//! A search as a program on the device.

use std::sync::Arc;

use vertebra_gpu::{Output, Program, Recording, Shared, Slot, Timing, workgroups};
use vertebra_shaders::Sort;
use vertebra_shaders::collision::{
    BLOCK_PAIRS, Bodies, COUNTERS, EXPAND_PAIRS, EXPANDED_A_ROUND, JOIN_PAIRS, Job, PAIRS_A_ROUND,
    PLACE_BODIES, Places, RECORD, SPLIT_PAIRS, Sizes, Split, Tolerance, moller, narrow, settle,
};

use super::collider::Resident;
use super::error::Error;
use super::room::{ENTRY, Room};
use super::search::{Ask, Kind, Search, Way};

/// Workgroups that share out a queue at most.
const GROUPS: u32 = 2048;

/// Lists of pairs with room for more than this are sorted on the device: some thirty dispatches, which take as long as
/// the host takes for so many.
const LONG: u32 = 1 << 14;

/// Where there is room for more undecided pairs than this, the device settles what it can: it takes a dispatch more, and
/// the host as long for so many.
const MANY: u32 = 1 << 12;

/// A program and its slots.
#[derive(Debug)]
pub(super) struct Ready {
    program: Program,
    pub(super) room: Room,
    timing: Timing,
    sizes: Slot<Sizes>,
    places: Slot<Places>,
    jobs: Slot<Job>,
    pub(super) found: Slot<u32>,
    /// Pairs that are left to the host.
    pub(super) records: Slot<u32>,
    pub(super) poses: Option<Slot<f32>>,
    /// What was last written to the slots.
    written: (Vec<Job>, Sizes, Places),
    /// Whether lists come sorted.
    pub(super) sorts: bool,
    /// Whether the device settles undecided pairs.
    pub(super) settles: bool,
}

/// The buffers of a mesh in a recording.
#[derive(Clone, Copy)]
struct Slots {
    vertices: Slot<f32>,
    leaves: Slot<[u32; 4]>,
    boxes: Slot<[f32; 4]>,
}

impl Slots {
    fn of(recording: &mut Recording, name: &str, mesh: &Resident) -> Self {
        recording.scope(name, |recording| Self {
            vertices: recording.shared("vertices", mesh.vertices.len()),
            leaves: recording.shared("leaves", mesh.leaves.len()),
            boxes: recording.shared("boxes", mesh.boxes.len()),
        })
    }

    fn are(&self, mesh: &Resident) -> [Shared; 3] {
        [
            self.vertices.is(&mesh.vertices),
            self.leaves.is(&mesh.leaves),
            self.boxes.is(&mesh.boxes),
        ]
    }
}

/// What all kernels of a search are recorded over.
struct Buffers {
    a: Slots,
    b: Slots,
    sizes: Slot<Sizes>,
    places: Slot<Places>,
    jobs: Slot<Job>,
    /// Counters and the answer.
    found: Slot<u32>,
    undecided: Slot<u32>,
}

impl Ready {
    pub(super) fn new(search: &Search, ask: Ask, room: Room) -> Result<Self, Error> {
        let (a, b) = (&search.a, &search.b);
        let answer_words = match ask.answer {
            Kind::Pairs => ENTRY * room.hits as usize,
            Kind::Matrix => ask.words[0] as usize * ask.rows as usize,
            Kind::Any | Kind::Count | Kind::Mask => ask.words[0] as usize * room.jobs as usize,
        };
        let mut recording = Recording::new("collision");
        // A buffer has one slot: of a mesh and itself both are one.
        let slots_a = Slots::of(&mut recording, "a", a);
        let slots_b = if Arc::ptr_eq(a, b) {
            slots_a
        } else {
            Slots::of(&mut recording, "b", b)
        };
        let buffers = Buffers {
            a: slots_a,
            b: slots_b,
            sizes: recording.buffer("sizes", 1),
            places: recording.buffer("places", 1),
            jobs: recording.buffer("jobs", room.jobs as usize),
            found: recording.buffer("found", COUNTERS + answer_words),
            undecided: recording.buffer("undecided", RECORD * room.undecided as usize),
        };
        recording.clear(buffers.found);
        let poses = search.poses.as_ref().map(|poses| {
            let slot = recording.shared::<f32>("poses", poses.len());
            let bodies = recording.buffer_from("bodies", &[Bodies { jobs: room.jobs }]);
            let list = [bodies.any(), slot.any(), buffers.jobs.any()];
            recording.dispatch(&PLACE_BODIES, &list, workgroups(room.jobs, 64));
            (slot, slot.is(poses))
        });
        match ask.way {
            Way::Moller(epsilon) => {
                let epsilon = f32::from_bits(epsilon);
                record_moller(&mut recording, &buffers, ask, room, Tolerance { epsilon });
            }
            Way::Blocks { level } => {
                let queue = record_pairs(&mut recording, &buffers, [a, b], room, level);
                record_narrow(&mut recording, &buffers, ask, room, queue);
            }
        }
        let settles = matches!(ask.way, Way::Blocks { .. }) && room.undecided > MANY;
        let records = if settles {
            record_settle(&mut recording, &buffers, ask, room)
        } else {
            buffers.undecided
        };
        let sorts = ask.answer == Kind::Pairs && room.jobs == 1 && room.hits > LONG;
        if sorts {
            record_sort(&mut recording, &buffers, ask, room, [a, b]);
        }
        recording.download(buffers.found);
        recording.download(records);
        let mut shared = slots_a.are(a).to_vec();
        if !Arc::ptr_eq(a, b) {
            shared.extend(slots_b.are(b));
        }
        let (poses, given) = poses.unzip();
        if let Some(slot) = poses {
            recording.download(slot);
        }
        shared.extend(given);
        Ok(Self {
            program: a.device.prepare_with(&recording, &shared)?,
            room,
            timing: Timing::Off,
            sizes: buffers.sizes,
            places: buffers.places,
            jobs: buffers.jobs,
            found: buffers.found,
            records,
            poses,
            written: (Vec::new(), Sizes::default(), Places::default()),
            sorts,
            settles,
        })
    }

    /// Runs it for these jobs, which begin at so many workgroups in all, and for the matrix from this row on.
    pub(super) fn run(
        &mut self,
        ask: Ask,
        (row, timing): (u32, Timing),
        (jobs, sizes): (&[Job], Sizes),
    ) -> Result<Output, Error> {
        if self.timing != timing {
            self.program.take_times(timing)?;
            self.timing = timing;
        }
        let mut padded = jobs.to_vec();
        padded.resize(self.room.jobs as usize, Job::default());
        let sizes = Sizes {
            queue: self.room.queue,
            ..sizes
        };
        let places = Places {
            queue: self.room.queue,
            hits: self.room.hits,
            undecided: self.room.undecided,
            left: self.room.left,
            answer: ask.words[0],
            answer_a: ask.words[1],
            row,
            rows: ask.rows,
        };
        // What the device has from the last run is not written again; rows of jobs that come from a buffer are no matter.
        let written = (padded, sizes, places);
        if self.written.0 != written.0 {
            self.program.write(self.jobs, &written.0)?;
        }
        if self.written.1 != written.1 {
            self.program.write(self.sizes, &[written.1])?;
        }
        if self.written.2 != written.2 {
            self.program.write(self.places, &[written.2])?;
        }
        self.written = written;
        Ok(self.program.run()?.wait()?)
    }
}

/// Triangles all against all.
fn record_moller(
    recording: &mut Recording,
    buffers: &Buffers,
    ask: Ask,
    room: Room,
    tolerance: Tolerance,
) {
    let tolerance = recording.buffer_from("tolerance", &[tolerance]);
    let list = [
        buffers.sizes.any(),
        buffers.places.any(),
        tolerance.any(),
        buffers.jobs.any(),
        buffers.a.vertices.any(),
        buffers.a.leaves.any(),
        buffers.b.vertices.any(),
        buffers.b.leaves.any(),
        buffers.found.any(),
    ];
    let kernel = moller(ask.answer.answer());
    recording.dispatch(&kernel, &list, workgroups(room.groups, 1));
}

/// The pairs of blocks whose boxes overlap, from the pairs of nodes of a level down: the queue they are in.
fn record_pairs(
    recording: &mut Recording,
    buffers: &Buffers,
    [a, b]: [&Resident; 2],
    room: Room,
    level: u32,
) -> Slot<u32> {
    let words = ENTRY * room.queue as usize;
    // Levels take turns.
    let even = recording.buffer::<u32>("queue", words);
    let odd = if level > 0 {
        recording.buffer::<u32>("queue above", words)
    } else {
        even
    };
    let of_level = |level: u32| if level.is_multiple_of(2) { even } else { odd };
    let list = |sizes: Slot<Sizes>, queue: Slot<u32>| {
        vec![
            sizes.any(),
            buffers.jobs.any(),
            buffers.a.boxes.any(),
            buffers.b.boxes.any(),
            queue.any(),
            buffers.found.any(),
        ]
    };
    let first = list(buffers.sizes, of_level(level));
    recording.dispatch(&BLOCK_PAIRS, &first, workgroups(room.groups, 1));
    for level in (0..level).rev() {
        let sizes = Sizes {
            queue: room.queue,
            level,
            a_at: a.level_at(level),
            b_at: b.level_at(level),
            ..Sizes::default()
        };
        let sizes = recording.buffer_from("level", &[sizes]);
        let mut list = list(sizes, of_level(level));
        list.push(of_level(level + 1).any());
        let rounds = room.queue.div_ceil(EXPANDED_A_ROUND);
        recording.dispatch(&EXPAND_PAIRS, &list, [rounds.clamp(1, GROUPS), 1, 1]);
    }
    even
}

/// The pairs of triangles of these pairs of blocks.
fn record_narrow(
    recording: &mut Recording,
    buffers: &Buffers,
    ask: Ask,
    room: Room,
    queue: Slot<u32>,
) {
    let kernel = narrow(ask.answer.answer(), ask.itself);
    let kernel = kernel.constant("LEAVE_HITS", u8::from(ask.leaves_hits));
    let list = [
        buffers.places.any(),
        buffers.jobs.any(),
        queue.any(),
        buffers.a.vertices.any(),
        buffers.a.leaves.any(),
        buffers.b.vertices.any(),
        buffers.b.leaves.any(),
        buffers.found.any(),
        buffers.undecided.any(),
    ];
    let rounds = room.queue.div_ceil(PAIRS_A_ROUND);
    recording.dispatch(&kernel, &list, [rounds.clamp(1, GROUPS), 1, 1]);
}

/// The undecided pairs, settled in integers: those that are left to the host.
fn record_settle(recording: &mut Recording, buffers: &Buffers, ask: Ask, room: Room) -> Slot<u32> {
    let left = recording.buffer::<u32>("left", RECORD * room.left as usize);
    let list = [
        buffers.places.any(),
        buffers.jobs.any(),
        buffers.undecided.any(),
        buffers.found.any(),
        left.any(),
    ];
    let kernel = settle(ask.answer.answer()).constant("LEAVE_HITS", u8::from(ask.leaves_hits));
    let rounds = room.undecided.div_ceil(64);
    recording.dispatch(&kernel, &list, [rounds.clamp(1, GROUPS), 1, 1]);
    left
}

/// Puts the list of pairs in lexicographic order: by the second triangle, then, keeping that order, by the first.
fn record_sort(
    recording: &mut Recording,
    buffers: &Buffers,
    ask: Ask,
    room: Room,
    [a, b]: [&Resident; 2],
) {
    let split = Split {
        pairs: room.hits,
        ordered: u32::from(ask.itself),
    };
    let split = recording.buffer_from("split", &[split]);
    let [first, second] =
        ["first", "second"].map(|name| recording.buffer::<u32>(name, room.hits as usize));
    let list = [split.any(), first.any(), second.any(), buffers.found.any()];
    let groups = workgroups(room.hits, 256);
    recording.dispatch(&SPLIT_PAIRS, &list, groups);
    let sort = Sort::on(&a.device);
    let bits = |mesh: &Resident| u32::BITS - mesh.triangles.leading_zeros();
    sort.record_counted(recording, second, first, bits(b), buffers.found);
    sort.record_counted(recording, first, second, bits(a), buffers.found);
    recording.dispatch(&JOIN_PAIRS, &list, groups);
}
