// Distance from 1 to the next number.
const EPSILON: real = 1.1920929e-7;
