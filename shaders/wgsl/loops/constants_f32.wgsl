// mu for loops that are nearly closed: above rounding of A.
const PROXIMAL: real = 1e-4;
// Violation over a loop's size that may be left where it does not vanish.
const ACCEPTED: real = 1e-4;
// The same with the factors of the state before, which new ones may improve.
const ACCEPTED_STALE: real = 1e-5;
