//! Memory that goes back to the system.

use railsqueal::parallel::World;

/// Resident memory of this process, MB.
fn resident() -> usize {
    let text = std::fs::read_to_string("/proc/self/smaps_rollup").expect("Linux");
    let line = text.lines().find_map(|l| l.strip_prefix("Rss:")).expect("a resident size");
    line.trim().trim_end_matches(" kB").parse::<usize>().expect("a number") / 1000
}

/// Part of 200 MB that remains when they are freed, with something after them at the end of the heap.
fn left() -> usize {
    let before = resident();
    let block = std::hint::black_box(vec![1u8; 200 << 20]);
    let end = std::hint::black_box(vec![1u8; 1 << 20]);
    drop(block);
    let after = resident();
    drop(end);
    after.saturating_sub(before)
}

/// The libraries that PETSc brings along keep what is freed; the program does not let them.
pub fn large_blocks_go_back(world: &World) {
    let kept = left();
    allocator::give_back();
    let back = left();
    if world.is_root() {
        println!("of 200 MB {kept} MB stay as the libraries have it, {back} MB as the program has it");
    }
    assert!(back < 20, "{kept} and {back} MB");
}

/// Free memory between blocks in use is returned when it is asked for, which is after each factorisation.
pub fn what_is_between_others_goes_back(world: &World) {
    allocator::give_back();
    let before = resident();
    // Every second of blocks that are alike: wherever they come to lie, those that stay are between those that go.
    let mut blocks: Vec<_> = (0..400).map(|_| Some(std::hint::black_box(vec![1u8; 1 << 20]))).collect();
    blocks.iter_mut().step_by(2).for_each(|block| *block = None);
    let in_use = before + 200;
    let kept = resident().saturating_sub(in_use);
    allocator::trim();
    let back = resident().saturating_sub(in_use);
    drop(blocks);
    if world.is_root() {
        println!("of 200 MB between others {kept} MB stay, {back} MB after a trim");
    }
    assert!(back < 20 && kept > 100, "{kept} and {back} MB");
}
