//! Several threads wait for one device.

use vertebra_gpu::{Device, Recording, tests_are_left_out};

#[test]
fn each_thread_reads_its_own_results() {
    if tests_are_left_out() {
        return;
    }
    let device = Device::auto().unwrap();
    let work = &|first: u32| {
        let mut recording = Recording::new("thread");
        let data = recording.buffer::<u32>("data", 1);
        recording.download(data);
        let program = device.prepare(&recording).unwrap();
        for number in first..first + 2000 {
            program.write(data, &[number]).unwrap();
            let read = program.run().unwrap().wait().unwrap().read(data).unwrap();
            assert_eq!(read, [number]);
        }
    };
    std::thread::scope(|scope| {
        for thread in 0..4 {
            scope.spawn(move || work(10_000 * thread));
        }
    });
}
