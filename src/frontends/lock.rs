//! Makes a socket ask for keys: ZeroMQ's CURVE (RFC 26).

use super::GatewayError;
use crate::client::CurveKey;

/// Milliseconds that a handshake may take; then the connection is closed.
const HANDSHAKE_MS: i32 = 10_000;

/// Checks that ZeroMQ has CURVE. Without it the service cannot know who connects.
///
/// - `has`: the result of `zmq::has("curve")`.
pub(super) fn check(has: Option<bool>) -> Result<(), GatewayError> {
    match has {
        Some(true) => Ok(()),
        _ => Err(GatewayError::NoCurve),
    }
}

/// Makes every client of `socket` prove which key it has. Call it before the socket is bound. CURVE
/// does not decide which keys are accepted; the [`super::zap::Authenticator`] does.
///
/// - `domain`: names the socket in the questions to the authenticator.
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
    fn without_curve_the_refusal_says_how_to_get_it() {
        for has in [None, Some(false)] {
            let error = check(has).unwrap_err().to_string();
            assert!(error.contains("CURVE") && error.contains("deploy/libzmq"), "{error}");
        }
        check(zmq::has("curve")).unwrap();
    }
}
