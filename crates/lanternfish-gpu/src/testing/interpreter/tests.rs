use super::Order;
use crate::{ShaderLibrary, testing::Memory};

const LIBRARY: ShaderLibrary = ShaderLibrary::new(&[(
    "kernel",
    "struct Item { key: u32, at: vec3f, is_used: u32 }
     struct List { count: atomic<u32>, first: u32, items: array<Item> }
     struct Found { slot: u32, is_new: bool, is_last: bool }
     @group(2) var<storage, read_write> list: List;
     @group(2) var<storage, read> numbers: array<u32>;
     @group(2) var<storage, read_write> results: array<u32>;
     const WEIGHTS = array(3u, 5u, 7u);

     fn put(key: u32) -> Found {
         for (var i = 0u; i < arrayLength(&list.items); i++) {
             if list.items[i].key == key { return Found(i, false, i + 1u == arrayLength(&list.items)); }
             if list.items[i].key != 0u { continue; }
             list.items[i].key = key;
             return Found(i, true, false);
         }
         return Found(99u, false, false);
     }

     fn add(sum: ptr<function, vec2u>, x: u32) { (*sum).y += WEIGHTS[x % 3u] * x; }

     @compute @workgroup_size(4)
     fn insert(@builtin(global_invocation_id) id: vec3u) {
         if id.x >= arrayLength(&numbers) { return; }
         let found = put(numbers[id.x]);
         results[id.x] = found.slot | (u32(found.is_new) << 8u) | (u32(found.is_last) << 9u);
         if found.is_new { atomicAdd(&list.count, 1u); }
         let taken = atomicCompareExchangeWeak(&list.count, 2u, 20u);
         if taken.exchanged { list.first = taken.old_value; }
     }

     @compute @workgroup_size(1)
     fn arithmetic() {
         var sum = vec2u(1u, 2u);
         var i = 0u;
         loop {
             add(&sum, i);
             continuing { i++; break if i == 5u; }
         }
         results[0] = sum.x + sum.y;
         results[1] = u32(-1.5) + u32(dot(vec3f(1.0, 2.0, 3.0), vec3f(1.0)) * 0.5);
         results[2] = bitcast<u32>(-7 / 2) ^ (0xffffffffu * 3u) ^ (7u / results[4]);
         let turned = mat2x2f(0.0, 1.0, -1.0, 0.0) * vec2f(2.0, 3.0);
         results[3] = select(7u, 8u, all(turned == vec2f(-3.0, 2.0)));
         let row = vec2f(2.0, 3.0) * mat3x2f(0.0, 1.0, -1.0, 0.0, 1.0, 1.0);
         results[5] = u32(all(row == vec3f(3.0, -2.0, 5.0)));
         list.items[0].at = vec3f(1.0, 2.0, 3.0).zyx * 2.0;
         list.items[0].at.x += 0.5;
         switch results[3] { case 8u { results[4] = 80u; } default { results[4] = 1u; } }
     }",
)]);

fn memory(items: usize) -> Memory {
    let mut memory = Memory::new();
    memory.bind(&["list"], &vec![0u32; 4 + 8 * items]);
    memory.bind(&["numbers"], &[7u32, 9, 7, 4, 2, 9]);
    memory.bind(&["results"], &[0u32; 6]);
    memory
}

#[test]
fn loops_structs_and_atomics_follow_the_shader() {
    let shader = LIBRARY.link("kernel", &[]).unwrap();
    let mut forward = memory(3);
    forward.interpret(&shader, "insert", [2, 1, 1], Order::Forward);
    // The third slot is the last one, so the key 2 gets none.
    assert_eq!(forward.get::<u32>("results"), [0x100, 0x101, 0, 0x102, 99, 1]);
    assert_eq!(forward.get::<u32>("list")[..2], [21, 2]);
    let mut backward = memory(3);
    backward.interpret(&shader, "insert", [2, 1, 1], Order::Backward);
    assert_eq!(backward.get::<u32>("results"), [99, 0, 99, 0x102, 0x101, 0x100]);
}

#[test]
fn arithmetic_follows_wgsl() {
    let shader = LIBRARY.link("kernel", &[]).unwrap();
    let mut memory = memory(1);
    memory.interpret(&shader, "arithmetic", [1; 3], Order::Forward);
    let expected = [1 + 2 + 5 + 14 + 9 + 20, 3, (-3i32 as u32) ^ (-3i32 as u32) ^ 7, 8, 80, 1];
    assert_eq!(memory.get::<u32>("results"), expected);
    let list: Vec<f32> = memory.get("list");
    assert_eq!(list[8..11], [6.5, 4.0, 2.0]);
}

#[test]
#[should_panic(expected = "numbers")]
fn an_unbound_buffer_is_named() {
    let shader = LIBRARY.link("kernel", &[]).unwrap();
    let mut memory = Memory::new();
    memory.bind(&["list"], &[0u32; 12]);
    memory.interpret(&shader, "insert", [1; 3], Order::Forward);
}
