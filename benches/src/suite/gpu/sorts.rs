//! The radix sort in all its shapes, and the primitives where only the device knows how many elements
//! there are.

use super::compare::{capture, compare};
use super::holds;
use super::primitives::on_words;
use crate::replay::fault;
use crate::suite::Outcome;
use oorandom::Rand32;
use vertebra_gpu::twin::Named;
use vertebra_gpu::{Device, Error, Failure, Problem};
use vertebra_shaders::{Rows, Sort, twins};

/// Pairs whose values tell equal keys apart, to be sorted by this sort on any machine.
pub(super) fn pairs(keys: Vec<u32>, sort: &Sort) -> Vec<Named> {
    let values: Vec<u32> = (0..).take(keys.len()).collect();
    vec![
        Named::new("keys", keys),
        Named::new("values", values),
        twins::shape(sort),
    ]
}

pub(super) fn sort(device: &Device) -> Outcome {
    let best = Sort::on(device);
    let mut figures = on_words(device, &twins::SORT, |keys, _| pairs(keys, &best))?;
    let mut rng = Rand32::new(7);
    for bits in [0, 1, 5, 8, 9, 24, 30] {
        let mut inputs = pairs((0..5000).map(|_| rng.rand_u32()).collect(), &best);
        inputs.push(Named::new("bits", vec![bits]));
        figures.extend(compare(
            device,
            &twins::SORT,
            &format!("{bits} bits"),
            &inputs,
        )?);
    }
    Ok(figures)
}

/// Every shape of the sort that the device can run, not only the one it is fastest with.
pub(super) fn sort_shapes(device: &Device) -> Outcome {
    let mut rng = Rand32::new(8);
    let mut figures = Vec::new();
    for rows in Rows::ALL {
        for items in Sort::ITEMS {
            let sort = Sort::new(rows, items);
            if !sort.fits(device) {
                continue;
            }
            for len in [2, 1000, 20_011] {
                let inputs = pairs((0..len).map(|_| rng.rand_u32() >> 7).collect(), &sort);
                let label = format!("{len} {rows:?} {items}");
                figures.extend(compare(device, &twins::SORT, &label, &inputs)?);
            }
        }
    }
    Ok(figures)
}

/// Where subgroups do not fill the rows of a shape, the sort says so instead of sorting wrongly.
pub(super) fn sort_in_a_wrong_shape(device: &Device) -> Outcome {
    let mut rng = Rand32::new(12);
    let keys: Vec<u32> = (0..5000).map(|_| rng.rand_u32()).collect();
    let mut figures = Vec::new();
    for rows in Rows::ALL {
        let sort = Sort::new(rows, 4);
        let inputs = pairs(keys.clone(), &sort);
        let says_so = |failures: &[Failure]| {
            let mut stages = failures.iter().map(|failure| &failure.stage);
            !failures.is_empty() && !sort.fits(device) && stages.all(|stage| stage == "sort")
        };
        let reason = match twins::SORT.compare(device, &inputs) {
            Err(Error::Recording { problems, .. }) if problems.iter().all(is_lacking) => continue,
            Err(error) => Some(error.to_string()),
            Ok((_, failures)) if says_so(&failures) => None,
            Ok((comparisons, failures)) => fault(&comparisons, &failures),
        };
        if let Some(reason) = reason {
            return Err(capture(
                device,
                "sort",
                &format!("{rows:?}"),
                &inputs,
                reason,
            ));
        }
        figures.push(holds(format!("{rows:?}"), true));
    }
    Ok(figures)
}

/// Whether it is the device that cannot do it at all.
fn is_lacking(problem: &Problem) -> bool {
    matches!(problem, Problem::Limit { .. } | Problem::Feature { .. })
}

/// Numbers of elements that only the device knows: none, tile edges, all, more than there are.
pub(super) fn counts_on_the_device(device: &Device) -> Outcome {
    let mut rng = Rand32::new(10);
    let best = Sort::on(device);
    let mut figures = Vec::new();
    for len in [0_u32, 1, 1000, 5000, 300_000] {
        let near = [1, 1023, 1024, 1025, 3073, 4096, len.saturating_sub(1)];
        let mut counts = vec![0, len, len.saturating_add(7), u32::MAX];
        counts.extend(near.into_iter().filter(|count| *count < len));
        // One pass more or less leaves the result in the other buffer.
        let bits = 24 + 8 * (len % 2);
        for count in counts {
            let words: Vec<u32> = (0..len).map(|_| rng.rand_u32()).collect();
            let flags: Vec<u32> = words.iter().map(|word| word >> 31).collect();
            let count = Named::new("count", vec![count]);
            let data = || vec![Named::new("data", words.clone()), count.clone()];
            let numbers: Vec<f32> = (0..len).map(|_| rng.rand_float() - 0.3).collect();
            let large: Vec<f64> = numbers.iter().map(|&x| f64::from(x) * 1e200).collect();
            let numbers = vec![Named::new("data", numbers), count.clone()];
            let large = vec![Named::new("data", large), count.clone()];
            let mut sorted = pairs(words.clone(), &best);
            sorted.extend([count.clone(), Named::new("bits", vec![bits])]);
            let mut all_bits = pairs(words.clone(), &best);
            all_bits.push(count.clone());
            let kept = vec![
                Named::new("flags", flags),
                Named::new("values", words.clone()),
                count.clone(),
            ];
            let cases = [
                (&twins::SCAN, data()),
                (&twins::AFFINE_SCAN, data()),
                (&twins::SORT, sorted),
                (&twins::SORT, all_bits),
                (&twins::COMPACT, kept),
                (&twins::REDUCE_F32, numbers),
                (&twins::REDUCE_F64, large),
            ];
            for (twin, inputs) in cases {
                if !device.features().contains(twin.features) {
                    continue;
                }
                let label = format!("{} of {len}, count {:?}", twin.name, count.values);
                figures.extend(compare(device, twin, &label, &inputs)?);
            }
        }
    }
    Ok(figures)
}
