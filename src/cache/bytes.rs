//! Numbers to bytes and back: little-endian, without padding; reading checks every length before it allocates.

/// Bytes in the making.
#[derive(Debug, Default)]
pub struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    pub fn count(&mut self, value: usize) {
        self.bytes.extend((value as u64).to_le_bytes());
    }

    pub fn number(&mut self, value: f64) {
        self.bytes.extend(value.to_bits().to_le_bytes());
    }

    /// An image (rows of `width` values) as what it has other than `like`: runs that are the same are counted, the others
    /// written out. The same to the last bit.
    pub fn image(&mut self, values: &[f32], like: impl Fn(&[f32], usize) -> f32) {
        self.count(values.len());
        let same = |i: usize| values[i].to_bits() == like(&values[..i], i).to_bits();
        let mut at = 0;
        while at < values.len() {
            let start = (at..values.len()).find(|&i| !same(i)).unwrap_or(values.len());
            let end = (start..values.len()).find(|&i| same(i)).unwrap_or(values.len());
            self.count(start - at);
            self.count(end - start);
            values[start..end].iter().for_each(|v| self.bytes.extend(v.to_bits().to_le_bytes()));
            at = end;
        }
    }

    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Bytes being read; every answer is `None` once they do not hold what is asked for.
#[derive(Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Reader<'a> {
        Reader { bytes }
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.bytes.split_first_chunk::<N>()?;
        self.bytes = rest;
        Some(*head)
    }

    pub fn count(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.take()?)).ok()
    }

    pub fn number(&mut self) -> Option<f64> {
        Some(f64::from_bits(u64::from_le_bytes(self.take()?)))
    }

    /// An image of `size` values that was written with the same `like`.
    pub fn image(&mut self, size: usize, like: impl Fn(&[f32], usize) -> f32) -> Option<Vec<f32>> {
        if self.count()? != size {
            return None;
        }
        let mut values = Vec::with_capacity(size);
        while values.len() < size {
            let (same, other) = (self.count()?, self.count()?);
            if same.checked_add(other)? > size - values.len() || same + other == 0 {
                return None;
            }
            (0..same).for_each(|_| values.push(like(&values, values.len())));
            let (written, rest) = self.bytes.split_at_checked(other * size_of::<f32>())?;
            self.bytes = rest;
            values.extend(written.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        }
        Some(values)
    }

    /// Whether all has been read.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    fn above(width: usize) -> impl Fn(&[f32], usize) -> f32 {
        move |values, i| if i < width { 0.0 } else { values[i - width] }
    }

    #[test]
    fn images_come_back_to_the_last_bit() {
        let mut stream = Stream::new(3, "bytes", 0);
        for width in [1, 7, 16] {
            let mut values: Vec<f32> = (0..width * 9).map(|_| stream.uniform() as f32).collect();
            values[0] = f32::NAN;
            values[width * 2] = -0.0;
            // Rows that go on, as beyond a crop.
            values.copy_within(width * 3..width * 4, width * 4);
            values.copy_within(width * 3..width * 4, width * 5);
            let mut writer = Writer::default();
            writer.image(&values, above(width));
            writer.number(0.1);
            let bytes = writer.finish();
            let mut reader = Reader::new(&bytes);
            let back = reader.image(values.len(), above(width)).unwrap();
            assert!(back.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert_eq!((reader.number(), reader.is_empty()), (Some(0.1), true));
            for cut in 0..bytes.len() - 8 {
                assert!(Reader::new(&bytes[..cut]).image(values.len(), above(width)).is_none(), "{cut}");
            }
        }
    }

    #[test]
    fn counts_out_of_reason_are_refused() {
        let mut writer = Writer::default();
        [4, usize::MAX, 2].into_iter().for_each(|n| writer.count(n));
        assert!(Reader::new(&writer.finish()).image(4, |_, _| 0.0).is_none());
        let mut writer = Writer::default();
        [4, 0, 0].into_iter().for_each(|n| writer.count(n));
        assert!(Reader::new(&writer.finish()).image(4, |_, _| 0.0).is_none());
    }
}
