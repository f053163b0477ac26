const LANES = 256u;
