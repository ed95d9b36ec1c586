//! Turns what was published and chosen into the renderer's picture, or into a word why the last one stays.

use crate::{
    error::is_failure,
    following::Published,
    graphics::Graphics,
    screenshot,
    session::{Effort, Session},
};
use photonstream_film::Display;
use photonstream_renderer_wgpu::{GpuError, View};
use std::time::Instant;

/// Draws what changed; how it is to be displayed, if there is a picture. What this device cannot draw is told: an option
/// is put back, of a scene or light the last picture stays.
///
/// # Errors
/// A device that has failed; for a window that shows a number of frames also a scene that it cannot draw.
pub(crate) fn picture(
    graphics: &mut Graphics,
    session: &mut Session,
    now: Instant,
) -> Result<Option<Display>, GpuError> {
    let Some(published) = session.published.clone() else { return Ok(None) };
    graphics.renderer.set_timed(session.shows_overlay || session.args.gpu.stats);
    if let Err(error) = take(graphics, &published) {
        // Nobody may be there to read it, only somebody who waits for the last frame.
        if is_failure(&error) || session.args.frames.is_some() {
            return Err(error);
        }
        let shown = if graphics.drawn.is_some() { "; this is the last picture" } else { "" };
        session.notices.warn(format!("{error}{shown}"), now);
        session.is_behind = true;
        return Ok(session.choices.as_ref().map(|choices| choices.display()));
    }
    // Once with what is chosen, and once with what could be drawn before.
    for _ in 0..2 {
        let Some(view) = session.view() else { return Ok(None) };
        let drawn = draw(graphics, session, &published, &view, now);
        session.is_behind = drawn.is_err();
        let Err(error) = drawn else {
            session.keep_choices();
            graphics.drawn = Some((view.width, view.height));
            break;
        };
        if is_failure(&error) {
            return Err(error);
        }
        session.notices.warn(error.to_string(), now);
        // The renderer has made room for a picture of the new size.
        graphics.drawn = graphics.drawn.filter(|&size| size == (view.width, view.height));
        if !session.put_back_choices() {
            break;
        }
    }
    Ok(session.choices.as_ref().map(|choices| choices.display()))
}

fn take(graphics: &mut Graphics, published: &Published) -> Result<(), GpuError> {
    graphics.renderer.set_scene(&published.scene)?;
    graphics.renderer.set_frame(&published.frame).map(drop)
}

fn draw(
    graphics: &mut Graphics,
    session: &mut Session,
    published: &Published,
    view: &View,
    now: Instant,
) -> Result<(), GpuError> {
    let drawn = graphics.renderer.draw(view)?;
    if drawn.redrawn {
        session.effort = Effort { frame_ms: now.elapsed().as_secs_f64() * 1e3, passes: drawn.passes };
        session.flaws.forget();
    }
    if session.shows_overlay {
        session.flaws.look(&graphics.renderer, view, &published.frame)?;
    }
    if std::mem::take(&mut session.wants_screenshot)
        && let Some(choices) = &session.choices
    {
        match screenshot::write(&mut graphics.renderer, published, choices, view, &session.args.out) {
            Ok([exr, png]) => session.notices.say(format!("{}, {}", exr.display(), png.display()), now),
            Err(error) => session.notices.warn(format!("no screenshot: {error}"), now),
        }
        // The file may have been drawn otherwise than the window shows it.
        graphics.renderer.draw(view)?;
    }
    Ok(())
}
