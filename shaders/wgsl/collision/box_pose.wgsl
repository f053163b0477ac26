// Boxes of B, seen from A: with centre c and half extents h, the box of all R v + t for v in the box is
// R c + t -+ |R| h. Each of its bounds is off by fewer than 16 roundings of 2^-23, in units of the largest
// coordinate of |R| max(|low|, |high|) + |t|: of the largest, because a matrix entry may be flushed to zero.
// What the matrix itself is off by is in the job's error.

const BOX_ERROR: f32 = 2e-6;

fn posed_box(job: Job, bounds: Box) -> Box {
    let center: vec3<f32> = 0.5 * (bounds.low + bounds.high);
    let extent: vec3<f32> = 0.5 * (bounds.high - bounds.low);
    let size = max(-bounds.low, bounds.high);
    let middle = rotated(job, center) + translation(job);
    let total = magnitudes(job, size) + abs(translation(job));
    let reach: vec3<f32> = vec3<f32>(
        dot(abs(job.rows[0].xyz), extent),
        dot(abs(job.rows[1].xyz), extent),
        dot(abs(job.rows[2].xyz), extent),
    ) + ((BOX_ERROR + job.coordinate_error) * max(max(total.x, total.y), total.z) + 2.0 * FLUSH);
    return Box(middle - reach, middle + reach);
}
