// Integers of 192 bits in two's complement, lowest word first.

const LIMBS: u32 = 6u;

struct Int {
    limbs: array<u32, LIMBS>,
}

// Of 64 bits.
fn widened(x: vec2<u32>) -> Int {
    let sign = select(0u, 0xffffffffu, (x.y & 0x80000000u) != 0u);
    return Int(array<u32, LIMBS>(x.x, x.y, sign, sign, sign, sign));
}

// The difference of two numbers of 64 bits that does not overflow.
fn difference(x: vec2<u32>, y: vec2<u32>) -> vec2<u32> {
    let low = x.x - y.x;
    return vec2<u32>(low, x.y - y.y - select(0u, 1u, x.x < y.x));
}

// The product of two words: its lower and its upper word.
fn product(x: u32, y: u32) -> vec2<u32> {
    let x_low = x & 0xffffu;
    let x_high = x >> 16u;
    let y_low = y & 0xffffu;
    let y_high = y >> 16u;
    let low = x_low * y_low;
    let middle = x_high * y_low + (low >> 16u);
    let other = x_low * y_high + (middle & 0xffffu);
    return vec2<u32>(
        (other << 16u) | (low & 0xffffu),
        x_high * y_high + (middle >> 16u) + (other >> 16u),
    );
}

fn times(x: Int, y: Int) -> Int {
    var a = x.limbs;
    var b = y.limbs;
    var sum = array<u32, LIMBS>(0u, 0u, 0u, 0u, 0u, 0u);
    for (var i = 0u; i < LIMBS; i++) {
        var carry = 0u;
        for (var k = 0u; k < LIMBS - i; k++) {
            let part = product(a[i], b[k]);
            let with_part = sum[i + k] + part.x;
            let with_carry = with_part + carry;
            carry = part.y + select(0u, 1u, with_part < part.x) + select(0u, 1u, with_carry < carry);
            sum[i + k] = with_carry;
        }
    }
    return Int(sum);
}

// x + y, or x - y where `turned` is all ones and `carried` is one.
fn sum_turned(x: Int, y: Int, turned: u32, carried: u32) -> Int {
    var a = x.limbs;
    var b = y.limbs;
    var carry = carried;
    for (var i = 0u; i < LIMBS; i++) {
        let other = b[i] ^ turned;
        let with_other = a[i] + other;
        let with_carry = with_other + carry;
        carry = select(0u, 1u, with_other < other || with_carry < carry);
        a[i] = with_carry;
    }
    return Int(a);
}

fn plus(x: Int, y: Int) -> Int {
    return sum_turned(x, y, 0u, 0u);
}

fn minus(x: Int, y: Int) -> Int {
    return sum_turned(x, y, 0xffffffffu, 1u);
}

fn sign_of(x: Int) -> i32 {
    var a = x.limbs;
    var any = 0u;
    for (var i = 0u; i < LIMBS; i++) {
        any |= a[i];
    }
    let positive = select(0, 1, any != 0u);
    return select(positive, -1, (a[LIMBS - 1u] & 0x80000000u) != 0u);
}
