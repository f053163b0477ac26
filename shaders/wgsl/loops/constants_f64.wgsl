// mu for loops that are nearly closed.
const PROXIMAL: real = 1e-8;
// Violation over a loop's size that may be left where it does not vanish.
const ACCEPTED: real = 1e-9;
// The same with the factors of the state before, which new ones may improve.
const ACCEPTED_STALE: real = 1e-13;
