const LANES = 128u;
