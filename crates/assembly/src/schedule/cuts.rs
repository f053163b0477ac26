//! Choosing the bodies of a path to be cut.

use super::ScheduleOptions;

/// Fills `ends` with the end of every chunk, counted in bodies from the path's head: the bodies at
/// `end - 1` are cut, but for the last.
///
/// The next cut is looked for where the chunk would have 2 window - longest to longest joints: the
/// heaviest body there or, so that a chunk need not wait for a late rake without reason, one at
/// least half as heavy of which rakes are there sooner; then the nearest to the window's length.
/// Bodies without weight are passed by. The last body of a path is not cut: nothing lies beyond.
pub(super) fn chunk_ends(
    weights: &[f64],
    ready: &[u32],
    options: &ScheduleOptions,
    ends: &mut Vec<usize>,
) {
    let ScheduleOptions {
        window,
        longest_chunk: longest,
    } = *options;
    ends.clear();
    let shortest = window.saturating_mul(2).saturating_sub(longest).max(1);
    let mut start = 0;
    while weights.len() - start > longest {
        let candidates = start + shortest..(start + longest + 1).min(weights.len());
        let heaviest = weights[candidates.start - 1..candidates.end - 1]
            .iter()
            .fold(0.0_f64, |heaviest, &weight| heaviest.max(weight));
        let chosen = if heaviest > 0.0 {
            candidates
                .filter(|&end| weights[end - 1] >= 0.5 * heaviest)
                .min_by(|&a, &b| {
                    let late = |end: usize| ready[end - 1];
                    let off = |end: usize| end.abs_diff(start + window);
                    (late(a).cmp(&late(b)))
                        .then(weights[b - 1].total_cmp(&weights[a - 1]))
                        .then(off(a).cmp(&off(b)))
                })
        } else {
            (candidates.end..weights.len()).find(|&end| weights[end - 1] > 0.0)
        };
        let Some(end) = chosen else {
            break;
        };
        ends.push(end);
        start = end;
    }
    ends.push(weights.len());
}
