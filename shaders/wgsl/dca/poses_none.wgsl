fn write_pose(slot: u32, rotation: vec4<real>, origin: vec3<real>) {}
