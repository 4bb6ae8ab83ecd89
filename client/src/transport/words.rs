//! How words are written into shared memory.
//!
//! A message is written where an older one stood, which another processor has read. Through the caches each line of it is taken from that
//! processor first: the transforms of 1,000 bodies take 11 µs, and 43 µs where the two have no cache in common. Large messages are
//! therefore written past the caches, and read from memory: 4 µs, wherever the two run (benchmark `messages`).

use std::mem::MaybeUninit;

use collided_protocol::step::Word;

/// From so many words on, writing past the caches is faster where both sides share a cache, the reader's time included; where they do not,
/// it would be from fewer on.
const LARGE: usize = 4096;

/// Writes words into memory that was loaned; zeros follow the content.
pub fn fill(memory: &mut [MaybeUninit<Word>], content: impl Iterator<Item = Word>) {
    if memory.len() < LARGE { write_all(memory, content, write) } else { past_caches::write_all(memory, content) }
}

/// Writes so many words into memory that was loaned for them.
///
/// # Panics
/// When the memory is not of as many words.
pub fn copy(memory: &mut [MaybeUninit<Word>], words: &[Word]) {
    assert_eq!(memory.len(), words.len(), "memory is loaned for the words");
    if memory.len() < LARGE { copy_all(memory, words) } else { past_caches::copy_all(memory, words) }
}

fn write_all(
    memory: &mut [MaybeUninit<Word>],
    content: impl Iterator<Item = Word>,
    write: impl Fn(&mut MaybeUninit<Word>, Word),
) {
    let mut places = memory.iter_mut();
    // Pushed, not pulled: to ask a chain of so many sections for each word takes longer than to write it.
    content.for_each(|word| {
        if let Some(place) = places.next() {
            write(place, word);
        }
    });
    for place in places {
        write(place, 0);
    }
}

fn write(place: &mut MaybeUninit<Word>, word: Word) {
    place.write(word);
}

fn copy_all(memory: &mut [MaybeUninit<Word>], words: &[Word]) {
    for (place, &word) in memory.iter_mut().zip(words) {
        place.write(word);
    }
}

#[cfg(not(target_arch = "x86_64"))]
mod past_caches {
    pub(super) use super::copy_all;
    use super::{MaybeUninit, Word};

    pub(super) fn write_all(memory: &mut [MaybeUninit<Word>], content: impl Iterator<Item = Word>) {
        super::write_all(memory, content, super::write);
    }
}

/// Every x86-64 processor has the instructions that are used here.
#[cfg(target_arch = "x86_64")]
mod past_caches {
    use std::arch::x86_64::{__m128i, _mm_loadu_si128, _mm_sfence, _mm_stream_si64, _mm_stream_si128};

    use super::{MaybeUninit, Word};

    pub(super) fn write_all(memory: &mut [MaybeUninit<Word>], content: impl Iterator<Item = Word>) {
        super::write_all(memory, content, |place, word| {
            // SAFETY: the place is exclusively ours, and `fence` follows.
            unsafe { _mm_stream_si64(place.as_mut_ptr().cast(), word.cast_signed()) };
        });
        fence();
    }

    /// By twos.
    pub(super) fn copy_all(memory: &mut [MaybeUninit<Word>], words: &[Word]) {
        // SAFETY: what may be uninitialised is valid as twos that may be.
        let (head, twos, tail) = unsafe { memory.align_to_mut::<MaybeUninit<__m128i>>() };
        let (first, rest) = words.split_at(head.len());
        super::copy_all(head, first);
        let (whole, rest) = rest.as_chunks::<2>();
        for (place, two) in twos.iter_mut().zip(whole) {
            // SAFETY: the place is exclusively ours and aligned, the words stand side by side, and `fence` follows.
            unsafe { _mm_stream_si128(place.as_mut_ptr(), _mm_loadu_si128(two.as_ptr().cast())) };
        }
        super::copy_all(tail, rest);
        fence();
    }

    /// What was written here is there for others before what is written from now on.
    fn fence() {
        // SAFETY: it asks nothing.
        unsafe { _mm_sfence() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_is_written_whole_and_in_order_with_zeros_behind() {
        for words in [0, 1, LARGE - 1, LARGE, LARGE + 1, LARGE + 13] {
            for first in 0..8 {
                for content in [0, 1, words / 2, words, words + 20] {
                    let mut memory = vec![MaybeUninit::new(u64::MAX); first + words + 1];
                    fill(&mut memory[first..first + words], (1..).take(content));
                    let expected = |place: usize| if place < content { 1 + place as Word } else { 0 };
                    assert_holds(&memory, first, &(0..words).map(expected).collect::<Vec<_>>());
                }
            }
        }
    }

    #[test]
    fn a_slice_is_copied_whole() {
        for words in [0, 1, LARGE - 1, LARGE, LARGE + 1, LARGE + 13] {
            for (first, skipped) in (0..64).map(|case| (case / 8, case % 8)) {
                let content: Vec<Word> = (1..).take(skipped + words).collect();
                let mut memory = vec![MaybeUninit::new(u64::MAX); first + words + 1];
                copy(&mut memory[first..first + words], &content[skipped..]);
                assert_holds(&memory, first, &content[skipped..]);
            }
        }
    }

    /// The words stand from `first` on, and nothing else was written.
    fn assert_holds(memory: &[MaybeUninit<Word>], first: usize, words: &[Word]) {
        // SAFETY: it was initialised when it was made.
        let memory: Vec<Word> = memory.iter().map(|word| unsafe { word.assume_init() }).collect();
        let (before, from) = memory.split_at(first);
        let (written, behind) = from.split_at(words.len());
        assert!(written == words);
        assert!(before.iter().chain(behind).all(|&word| word == u64::MAX));
    }
}
