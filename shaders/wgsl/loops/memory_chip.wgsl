// The numbers of a group on chip, where a barrier costs little: fetched before and kept after.

var<workgroup> chip: array<real, CHIP>;
var<private> chip_start: u32;

fn number(at: u32) -> real { return chip[at - chip_start]; }

fn put_number(at: u32, value: real) { chip[at - chip_start] = value; }

fn wait_for_numbers() { workgroupBarrier(); }

fn fetch_numbers(g: Group, lane: u32) {
    chip_start = g.memory;
    // Accelerations come first and make everything anew.
    if layer.ways != 0u {
        let passes = passes_for(g.length);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let i = pass_ * LANES + lane;
            if i < g.length {
                chip[i] = real(loops[g.memory + i]);
            }
        }
        workgroupBarrier();
    }
}

fn keep_numbers(g: Group, lane: u32) {
    if layer.ways == 0u {
        let passes = passes_for(g.length);
        for (var pass_ = 0u; pass_ < passes; pass_++) {
            let i = pass_ * LANES + lane;
            if i < g.length {
                loops[g.memory + i] = chunk_real(chip[i]);
            }
        }
    }
}
