//! Scans and reductions in the order of the shaders, combination by combination: the same bits.

use crate::kernels::{THREADS, TILE};

const LANES: usize = THREADS as usize;
const ITEMS: usize = (TILE / THREADS) as usize;
const ROUNDS: u32 = LANES.ilog2();

/// The exclusive and the inclusive scan.
pub(super) fn scan<T: Copy>(data: &[T], identity: T, combine: fn(T, T) -> T) -> [Vec<T>; 2] {
    let tiles: Vec<&[T]> = data.chunks(TILE as usize).collect();
    let before = if tiles.len() > 1 {
        let totals = tiles.iter().map(|tile| total(tile, identity, combine));
        let totals: Vec<T> = totals.collect();
        let [exclusive, _] = scan(&totals, identity, combine);
        exclusive
    } else {
        vec![identity]
    };
    let [mut exclusive, mut inclusive] = [Vec::new(), Vec::new()];
    for (tile, before) in tiles.into_iter().zip(before) {
        let mut partial = lanes(tile, identity, combine);
        for round in 0..ROUNDS {
            let width = 1 << round;
            // From the last lane down, so that what is read is of the last round.
            for lane in (width..LANES).rev() {
                partial[lane] = combine(partial[lane - width], partial[lane]);
            }
        }
        for (lane, items) in tile.chunks(ITEMS).enumerate() {
            let mut running = before;
            if lane > 0 {
                running = combine(running, partial[lane - 1]);
            }
            for &item in items {
                exclusive.push(running);
                running = combine(running, item);
                inclusive.push(running);
            }
        }
    }
    [exclusive, inclusive]
}

/// What all combine to: tiles, then tiles of their totals.
pub(super) fn reduce<T: Copy>(data: &[T], identity: T, combine: fn(T, T) -> T) -> T {
    if data.len() <= TILE as usize {
        return total(data, identity, combine);
    }
    let tiles = data.chunks(TILE as usize);
    let totals: Vec<T> = tiles.map(|tile| total(tile, identity, combine)).collect();
    reduce(&totals, identity, combine)
}

/// What a tile combines to: neighbours join.
fn total<T: Copy>(tile: &[T], identity: T, combine: fn(T, T) -> T) -> T {
    let mut partial = lanes(tile, identity, combine);
    for round in 0..ROUNDS {
        let width = 1 << round;
        for left in (0..LANES).step_by(2 * width) {
            partial[left] = combine(partial[left], partial[left + width]);
        }
    }
    partial[0]
}

/// What the items of each lane combine to.
fn lanes<T: Copy>(tile: &[T], identity: T, combine: fn(T, T) -> T) -> Vec<T> {
    let items = tile.chunks(ITEMS);
    let totals = items.map(|items| items.iter().fold(identity, |a, &b| combine(a, b)));
    totals
        .chain(std::iter::repeat(identity))
        .take(LANES)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x -> a x + b modulo 2^32, the first map first: it does not commute.
    fn affine((a, b): (u32, u32), (c, d): (u32, u32)) -> (u32, u32) {
        let b = c.wrapping_mul(b).wrapping_add(d);
        (a.wrapping_mul(c), b)
    }

    #[test]
    fn a_tree_of_exact_operations_is_what_they_are_one_by_one() {
        for len in [0, 1, 3, 4, 5, 1023, 1024, 1025, 5000, 1_050_000] {
            let maps: Vec<(u32, u32)> = (0..len).map(|i| (i | 1, i >> 3)).collect();
            let [exclusive, inclusive] = scan(&maps, (1, 0), affine);
            let mut running = (1, 0);
            for (i, &map) in maps.iter().enumerate() {
                assert_eq!(exclusive[i], running, "{i} of {len}");
                running = affine(running, map);
                assert_eq!(inclusive[i], running, "{i} of {len}");
            }
            assert_eq!(exclusive.len(), maps.len());
            assert_eq!(reduce(&maps, (1, 0), affine), running, "all of {len}");
        }
    }

    #[test]
    fn sums_of_numbers_round_as_sums_in_pairs_do() {
        // Rounding of n terms in pairs: eps log2(n) sum |x| (Higham 1993), with the rounds within
        // a lane and of the running sum.
        let numbers: Vec<f32> = (0..300_000_u32)
            .map(|i| ((i * 7919) % 1000) as f32 * 1e-3 - 0.3)
            .collect();
        let [_, inclusive] = scan(&numbers, 0.0, |a, b| a + b);
        let (mut sum, mut absolute) = (0.0_f64, 0.0_f64);
        for (i, (&x, &found)) in numbers.iter().zip(&inclusive).enumerate() {
            sum += f64::from(x);
            absolute += f64::from(x.abs());
            let bound = f64::from(f32::EPSILON) * (12.0 + ((i + 1) as f64).log2()) * absolute;
            assert!((f64::from(found) - sum).abs() <= bound, "{i}");
        }
        let found = reduce(&numbers, 0.0, |a, b| a + b);
        let rounds = 12.0 + (numbers.len() as f64).log2();
        let bound = f64::from(f32::EPSILON) * rounds * absolute;
        assert!((f64::from(found) - sum).abs() <= bound, "all");
    }
}
