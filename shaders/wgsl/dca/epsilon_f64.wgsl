// Distance from 1 to the next number.
const EPSILON: real = 2.220446049250313e-16;
