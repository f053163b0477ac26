//! Whether a model has a place on a device, and how large a one would.

use super::scalar::Scalar;
use super::tables::Tables;
use crate::Error;
use vertebra_gpu::wgpu::Limits;

/// Refuses a model of which a buffer exceeds the device's limits, with the limit and the number of
/// bodies that would fit of a model like it.
pub(super) fn check<T: Scalar, L: Scalar>(tables: &Tables, limits: &Limits) -> Result<(), Error> {
    let (four, joined) = (4 * size_of::<T>(), 4 * size_of::<L>());
    let of_bodies = [
        tables.scratch_len() * four,
        tables.nodes_len() * joined,
        tables.links.len() * four,
        tables.state_len() * size_of::<T>(),
        tables.words.len() * size_of::<u32>(),
    ];
    let of_bodies = of_bodies.into_iter().max().unwrap_or(0);
    let of_loops = tables.loops.map_or(0, |loops| loops.memory) * size_of::<T>();
    let (needed, what) = if of_loops > of_bodies {
        (of_loops as u64, "closed loops")
    } else {
        (of_bodies as u64, "bodies")
    };
    let bodies = tables.bodies.len();
    for (limit, available) in [
        (
            "max_storage_buffer_binding_size",
            limits.max_storage_buffer_binding_size,
        ),
        ("max_buffer_size", limits.max_buffer_size),
    ] {
        if needed > available {
            // Buffers grow as the bodies do; a sixteenth less for rounds that fill up otherwise.
            let share = u128::from(available) * bodies as u128 / u128::from(needed);
            let fit = usize::try_from(share - share / 16).unwrap_or(bodies);
            return Err(Error::ModelTooLarge {
                bodies,
                what,
                fit,
                limit,
                available,
            });
        }
    }
    Ok(())
}
