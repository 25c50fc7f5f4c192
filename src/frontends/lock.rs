//! The lock of a door with keys: ZeroMQ's CURVE (RFC 26).

use super::GatewayError;
use crate::client::CurveKey;

/// Milliseconds that a handshake may take; then the connection is closed.
const HANDSHAKE_MS: i32 = 10_000;

/// Without CURVE nobody could tell who is knocking, so nobody beyond this machine may knock.
///
/// - `has`: what `zmq::has("curve")` says.
pub(super) fn check(has: Option<bool>) -> Result<(), GatewayError> {
    match has {
        Some(true) => Ok(()),
        _ => Err(GatewayError::NoCurve),
    }
}

/// Makes whoever connects to `socket` prove which key they have. Before it is bound; and only the
/// [`super::zap::Authenticator`] holds those keys against the register.
///
/// - `domain`: what the authenticator is told of where they knock.
pub(super) fn put_on(socket: &zmq::Socket, key: &CurveKey, domain: &str) -> zmq::Result<()> {
    socket.set_curve_server(true)?;
    socket.set_curve_publickey(&key.public().0)?;
    socket.set_curve_secretkey(key.secret())?;
    socket.set_handshake_ivl(HANDSHAKE_MS)?;
    socket.set_zap_domain(domain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_curve_the_refusal_says_how_to_mend_it() {
        for has in [None, Some(false)] {
            let error = check(has).unwrap_err().to_string();
            assert!(error.contains("CURVE") && error.contains("deploy/libzmq"), "{error}");
        }
        check(zmq::has("curve")).unwrap();
    }
}
