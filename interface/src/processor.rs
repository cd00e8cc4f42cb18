//! Ends a program that is built for AVX2 on a processor without it, with a sentence and exit status 2.
//!
//! The whole program, `main` included, is compiled for x86-64-v3 (`docs/decisions/0009-target-cpu.md`): the compiler may
//! use those instructions anywhere, and `is_x86_feature_detected!` is true when it is compiled. So the check is written
//! in instructions that every x86-64 has, and is the first entry of `.init_array`, which the C library calls before `main`.

#![expect(
    unsafe_code,
    reason = "assembly is the only code that the compiler does not write in newer instructions"
)]

/// Makes sure that the processor was looked at when the program started. To name it is what links the check into a
/// program: each that can be started as a solver or as `tandem` does.
pub fn assert_checked() {
    #[cfg(all(target_arch = "x86_64", target_os = "linux", target_feature = "avx2"))]
    {
        // SAFETY: a byte of this program, written once before `main`.
        let checked = unsafe { core::ptr::addr_of!(x86::tandem_processor_checked).read_volatile() };
        assert_eq!(checked, 1, "the processor was not looked at before `main`");
    }
}

#[cfg(all(target_arch = "x86_64", target_os = "linux", target_feature = "avx2"))]
mod x86 {
    use core::arch::global_asm;

    // The features are those of the System V psABI (section "x86-64-v3"), by their bits in the manuals of Intel and AMD.
    global_asm!(
        ".pushsection .init_array.00001, \"aw\", @init_array",
        ".p2align 3",
        ".quad tandem_processor_check",
        ".popsection",
        ".pushsection .bss.tandem_processor, \"aw\", @nobits",
        ".hidden tandem_processor_checked",
        ".globl tandem_processor_checked",
        "tandem_processor_checked: .skip 1",
        ".popsection",
        ".pushsection .rodata.tandem_processor, \"a\", @progbits",
        "tandem_processor_words:",
        ".ascii \"error: this program needs a processor with AVX2 and FMA (x86-64-v3: nearly all since 2015), and this one lacks them; run it on another machine\\n\"",
        ".set tandem_processor_length, . - tandem_processor_words",
        ".popsection",
        ".pushsection .text.tandem_processor, \"ax\", @progbits",
        // extern "C" fn(ecx of leaf 1, ebx of leaf 7, ecx of leaf 0x80000001, low half of XCR0) -> 1 if something lacks
        ".hidden tandem_processor_lacks",
        ".globl tandem_processor_lacks",
        "tandem_processor_lacks:",
        "and edi, {leaf_1}",
        "cmp edi, {leaf_1}",
        "jne 2f",
        "and esi, {leaf_7}",
        "cmp esi, {leaf_7}",
        "jne 2f",
        "and edx, {extended}",
        "cmp edx, {extended}",
        "jne 2f",
        "and ecx, {kept}",
        "cmp ecx, {kept}",
        "jne 2f",
        "xor eax, eax",
        "ret",
        "2: mov eax, 1",
        "ret",
        "tandem_processor_check:",
        "push rbx",
        "xor eax, eax",
        "cpuid",
        "cmp eax, 7", // the highest leaf
        "jb 3f",
        "mov eax, 1",
        "cpuid",
        "mov edi, ecx",
        "bt edi, 27", // OSXSAVE: without it there is no XGETBV
        "jnc 3f",
        "mov eax, 7",
        "xor ecx, ecx",
        "cpuid",
        "mov esi, ebx",
        "mov eax, 0x80000001",
        "cpuid",
        "mov r8d, ecx",
        "xor ecx, ecx",
        "xgetbv",
        "mov ecx, eax",
        "mov edx, r8d",
        "call tandem_processor_lacks",
        "test eax, eax",
        "jnz 3f",
        "mov byte ptr [rip + tandem_processor_checked], 1",
        "pop rbx",
        "ret",
        "3: mov eax, 1", // write
        "mov edi, 2",
        "lea rsi, [rip + tandem_processor_words]",
        "mov edx, offset tandem_processor_length",
        "syscall",
        "mov eax, 231", // exit_group
        "mov edi, 2",
        "syscall",
        ".popsection",
        leaf_1 = const LEAF_1,
        leaf_7 = const LEAF_7,
        extended = const EXTENDED,
        kept = const KEPT,
    );

    /// SSE3, SSSE3, FMA, CMPXCHG16B, SSE4.1, SSE4.2, MOVBE, POPCNT, OSXSAVE, AVX, F16C.
    pub const LEAF_1: i32 = 1
        | 1 << 9
        | 1 << 12
        | 1 << 13
        | 1 << 19
        | 1 << 20
        | 1 << 22
        | 1 << 23
        | 1 << 27
        | 1 << 28
        | 1 << 29;
    /// BMI1, AVX2, BMI2.
    pub const LEAF_7: i32 = 1 << 3 | 1 << 5 | 1 << 8;
    /// LAHF, LZCNT.
    pub const EXTENDED: i32 = 1 | 1 << 5;
    /// The system keeps the halves of vectors of a process that does not run.
    pub const KEPT: i32 = 1 << 1 | 1 << 2;

    unsafe extern "C" {
        pub static tandem_processor_checked: u8;
        #[cfg(test)]
        pub fn tandem_processor_lacks(leaf_1: u32, leaf_7: u32, extended: u32, kept: u32) -> u32;
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        /// What the check makes of the bits of a processor.
        fn lacks(bits: [i32; 4]) -> bool {
            let [a, b, c, d] = bits.map(i32::cast_unsigned);
            // SAFETY: a function of four numbers that touches no memory.
            unsafe { tandem_processor_lacks(a, b, c, d) == 1 }
        }

        #[test]
        fn each_feature_is_needed() {
            let needed = [LEAF_1, LEAF_7, EXTENDED, KEPT];
            assert!(!lacks(needed));
            assert!(!lacks([-1; 4]));
            let mut count = 0;
            for (word, bits) in needed.into_iter().enumerate() {
                for bit in (0..32).map(|bit| 1 << bit).filter(|bit| bits & bit != 0) {
                    let mut without = [-1; 4];
                    without[word] &= !bit;
                    assert!(lacks(without), "bit {bit:#x} of word {word}");
                    count += 1;
                }
            }
            assert_eq!(count, 18);
        }
    }
}
