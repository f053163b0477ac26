//! Several threads wait for one device.
#![expect(clippy::unwrap_used, reason = "a test says what is wrong by failing")]

use vertebra_gpu::{Device, Recording, adapters};

#[test]
fn each_thread_reads_its_own_results() {
    if adapters().is_empty() && std::env::var_os("CI").is_none() {
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
