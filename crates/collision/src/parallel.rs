//! Work for one or several threads, with results that do not depend on how many.
//!
//! A number of threads is at most so many of the current rayon pool; 0 means all of them. Asking rayon anything starts
//! its threads, so work for one thread must not ask.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The number of threads that there are of those wanted, 0 for all.
#[cfg(feature = "rayon")]
pub(crate) fn available(threads: usize) -> usize {
    match threads {
        1 => 1,
        0 => rayon::current_num_threads(),
        _ => threads.min(rayon::current_num_threads()),
    }
}

#[cfg(not(feature = "rayon"))]
pub(crate) fn available(_threads: usize) -> usize {
    1
}

/// Does two things, at once if there are two threads or more.
pub(crate) fn join<L: Send, R: Send>(
    threads: usize,
    left: impl FnOnce() -> L + Send,
    right: impl FnOnce() -> R + Send,
) -> (L, R) {
    #[cfg(feature = "rayon")]
    if threads > 1 {
        return rayon::join(left, right);
    }
    let _ = threads;
    (left(), right())
}

/// The function's values at 0..count, in this order.
pub(crate) fn map<T: Send>(
    threads: usize,
    count: usize,
    function: impl Fn(usize) -> T + Send + Sync,
) -> Vec<T> {
    #[cfg(feature = "rayon")]
    if threads > 1 {
        use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
        let share = (count / threads).max(1);
        return (0..count)
            .into_par_iter()
            .with_min_len(share)
            .map(function)
            .collect();
    }
    let _ = threads;
    (0..count).map(function).collect()
}

/// The function's values at 0..count, in this order; each is computed when a thread comes free.
pub(crate) fn in_order<T: Send>(
    threads: usize,
    count: usize,
    function: impl Fn(usize) -> T + Send + Sync,
) -> Vec<T> {
    let keep = |index, values: &mut Vec<(usize, T)>| {
        values.push((index, function(index)));
        ControlFlow::Continue(())
    };
    let mut values: Vec<_> = share(threads, count, Vec::new, keep)
        .into_iter()
        .flatten()
        .collect();
    values.sort_unstable_by_key(|(index, _)| *index);
    values.into_iter().map(|(_, value)| value).collect()
}

/// Hands the tasks 0..count to workers as they come free, one state a worker, until a task breaks.
///
/// Which state gets which tasks depends on timing, so callers merge states by operations that do not care.
pub(crate) fn share<S: Send>(
    threads: usize,
    count: usize,
    new_state: impl Fn() -> S + Send + Sync,
    task: impl Fn(usize, &mut S) -> ControlFlow<()> + Send + Sync,
) -> Vec<S> {
    let next = AtomicUsize::new(0);
    let done = AtomicBool::new(false);
    let worker = |_| {
        let mut state = new_state();
        while !done.load(Ordering::Relaxed) {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            if task(index, &mut state).is_break() {
                done.store(true, Ordering::Relaxed);
            }
        }
        state
    };
    let workers = threads.min(count);
    map(workers, workers, worker)
}

#[cfg(all(test, feature = "rayon"))]
mod tests {
    use super::*;

    /// Task 0 waits for task 1, which so has another worker, and that for all others.
    #[test]
    fn values_stand_in_order_whoever_computed_them() {
        const COUNT: usize = 8;
        let (begun, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let wait = |counter: &AtomicUsize, wanted| {
            while counter.load(Ordering::Acquire) < wanted {
                std::thread::yield_now();
            }
        };
        let task = |index| {
            begun.fetch_add(1, Ordering::Release);
            match index {
                0 => wait(&begun, 2),
                1 => wait(&done, COUNT - 1),
                _ => {}
            }
            done.fetch_add(1, Ordering::Release);
            index
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
        let values = pool.unwrap().install(|| in_order(2, COUNT, task));
        assert_eq!(values, (0..COUNT).collect::<Vec<_>>());
    }
}
