// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/pictures.hh"

#include "world/gui_loader.hh"

namespace Stg::program {

std::unique_ptr<PictureRun> PictureRun::Open(const Options& options) {
  const offscreen::PictureOptions& picture_options = options.pictures;
  if (picture_options.shots.empty() && picture_options.film.empty()) return nullptr;
  std::string message;
  const auto make =
      reinterpret_cast<offscreen::MakePictures>(FindInGui("stage_make_pictures", &message));
  if (!make) throw PictureError("no pictures: " + message);
  offscreen::Pictures* pictures = make(picture_options, &message);
  if (!pictures) throw UsageError(message);
  return std::unique_ptr<PictureRun>(new PictureRun(pictures));
}

World* PictureRun::MakeWorld() { return world_ = pictures_->MakeWorld(); }

void PictureRun::Begin(const Options& options) {
  std::string message;
  if (!pictures_->Begin(&message)) throw PictureError("no pictures: " + message);
  world_->speedup = 0;  // as fast as possible
  Make();
  const bool film = !options.pictures.film.empty();
  if (options.run.duration == 0 && !film) world_->Quit();  // all images show the start
}

void PictureRun::Make() {
  std::string message;
  if (!pictures_->Make(&message)) throw PictureError(message);
}

void PictureRun::End(bool interrupted) {
  std::string message;
  if (!pictures_->End(interrupted, &message)) throw PictureError(message);
}

}  // namespace Stg::program
