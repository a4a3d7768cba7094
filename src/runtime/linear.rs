//! Small dense linear algebra: what calibration and the densities need, and no more.

/// A symmetric positive definite system `a x = b` by Cholesky; `None` when `a` is not positive definite. Row-major n × n.
pub fn solve_spd(a: &[f64], b: &[f64]) -> Option<Vec<f64>> {
    let l = cholesky(a, b.len())?;
    Some(solve_with(&l, b))
}

/// Lower triangle of a symmetric positive definite matrix, row-major.
pub fn cholesky(a: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut l = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            let rest = a[i * n + j] - dot;
            if i == j {
                if rest.is_nan() || rest <= 0.0 {
                    return None;
                }
                l[i * n + i] = rest.sqrt();
            } else {
                l[i * n + j] = rest / l[j * n + j];
            }
        }
    }
    Some(l)
}

/// Solves `l lᵀ x = b`.
pub fn solve_with(l: &[f64], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut x = b.to_vec();
    for i in 0..n {
        let dot: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i * n + i];
    }
    for i in (0..n).rev() {
        let dot: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
        x[i] = (x[i] - dot) / l[i * n + i];
    }
    x
}

/// Eigenvalues (descending) and unit eigenvectors (rows) of a symmetric matrix by cyclic Jacobi rotations.
pub fn symmetric_eigen(matrix: &[f64], n: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    const SWEEPS: usize = 30;
    /// Off-diagonal elements below this share of the trace are rounding.
    const ROUNDING: f64 = 1e-13;
    let mut a = matrix.to_vec();
    let mut v = vec![0.0; n * n];
    for i in 0..n {
        v[i * n + i] = 1.0;
    }
    let trace: f64 = (0..n).map(|i| a[i * n + i].abs()).sum();
    for _ in 0..SWEEPS {
        let apart = |i: usize| i / n != i % n;
        if (0..n * n).filter(|&i| apart(i)).all(|i| a[i].abs() <= ROUNDING * trace) {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut a, &mut v, n, p, q);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| a[j * n + j].total_cmp(&a[i * n + i]).then(i.cmp(&j)));
    let values = order.iter().map(|&i| a[i * n + i]).collect();
    let vectors = order.iter().map(|&i| (0..n).map(|k| v[k * n + i]).collect()).collect();
    (values, vectors)
}

/// One Jacobi rotation that makes `a[p][q]` zero.
fn rotate(a: &mut [f64], v: &mut [f64], n: usize, p: usize, q: usize) {
    let apq = a[p * n + q];
    if apq == 0.0 {
        return;
    }
    let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * apq);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let t = if theta == 0.0 { 1.0 } else { t };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for k in 0..n {
        let (akp, akq) = (a[k * n + p], a[k * n + q]);
        a[k * n + p] = c * akp - s * akq;
        a[k * n + q] = s * akp + c * akq;
    }
    for k in 0..n {
        let (apk, aqk) = (a[p * n + k], a[q * n + k]);
        a[p * n + k] = c * apk - s * aqk;
        a[q * n + k] = s * apk + c * aqk;
    }
    for k in 0..n {
        let (vkp, vkq) = (v[k * n + p], v[k * n + q]);
        v[k * n + p] = c * vkp - s * vkq;
        v[k * n + q] = s * vkp + c * vkq;
    }
}

/// min over x >= 0 of xᵀ a x / 2 - bᵀ x for positive definite a (the normal equations of non-negative least squares), by
/// cyclic coordinate descent: exact in the limit, and monotone.
pub fn nonnegative(a: &[f64], b: &[f64]) -> Vec<f64> {
    const ROUNDS: usize = 500;
    let n = b.len();
    let mut x = vec![0.0; n];
    for _ in 0..ROUNDS {
        for i in 0..n {
            let diagonal = a[i * n + i];
            if diagonal > 0.0 {
                let dot: f64 = (0..n).filter(|&k| k != i).map(|k| a[i * n + k] * x[k]).sum();
                x[i] = ((b[i] - dot) / diagonal).max(0.0);
            }
        }
    }
    x
}

/// The middle value; sorts its argument. 0 for an empty slice.
pub fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: [f64; 9] = [4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0];

    #[test]
    fn cholesky_solves() {
        let x = solve_spd(&A, &[1.0, 2.0, 3.0]).unwrap();
        for i in 0..3 {
            let row: f64 = (0..3).map(|j| A[i * 3 + j] * x[j]).sum();
            assert!((row - [1.0, 2.0, 3.0][i]).abs() < 1e-12);
        }
        assert!(solve_spd(&[1.0, 2.0, 2.0, 1.0], &[0.0, 0.0]).is_none());
    }

    #[test]
    fn eigenvectors_reproduce_the_matrix() {
        let (values, vectors) = symmetric_eigen(&A, 3);
        assert!(values[0] >= values[1] && values[1] >= values[2]);
        for i in 0..3 {
            for j in 0..3 {
                let sum: f64 = (0..3).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                assert!((sum - A[i * 3 + j]).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn nonnegative_meets_the_optimality_conditions() {
        let b = [1.0, -2.0, 3.0];
        let x = nonnegative(&A, &b);
        for i in 0..3 {
            let gradient: f64 = (0..3).map(|j| A[i * 3 + j] * x[j]).sum::<f64>() - b[i];
            assert!(x[i] >= 0.0 && gradient > -1e-9 && (x[i] * gradient).abs() < 1e-9);
        }
    }
}
