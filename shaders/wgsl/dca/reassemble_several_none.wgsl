// For models without joints of several freedoms.

fn let_turning_go_again(change: Change, v: u32) -> Change { return change; }

fn let_all_go_again(change: Change, v: u32) -> Change { return change; }
