//! Lists of what is kept, written without a branch.

/// Of what is looked at one by one, what is kept. Whether an item is kept is hard to foretell: it is written all the same, and counted if
/// it is, which costs no branch.
#[derive(Debug, Default)]
pub(super) struct List<T> {
    items: Vec<T>,
    count: usize,
}

/// A list that is being written.
pub(super) struct Writer<'l, T> {
    items: &'l mut [T],
    /// Items before what is written next.
    pub count: usize,
}

impl<T: Copy + Default> List<T> {
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Writes behind what is kept, so many items at most. What is written is kept by [`end`](Self::end).
    // No closure: what it does would not be inlined, and then not compiled for the processor.
    #[inline(always)]
    pub fn write(&mut self, more: usize) -> Writer<'_, T> {
        if self.items.len() < self.count + more {
            self.items.resize((self.count + more).next_power_of_two(), T::default());
        }
        Writer { items: &mut self.items, count: self.count }
    }

    #[inline(always)]
    pub fn end(&mut self, count: usize) {
        self.count = count;
    }

    #[inline(always)]
    pub fn kept(&self) -> &[T] {
        &self.items[..self.count]
    }
}

impl<T> Writer<'_, T> {
    #[inline(always)]
    pub fn put(&mut self, item: T, is_kept: bool) {
        self.items[self.count] = item;
        self.count += usize::from(is_kept);
    }
}
