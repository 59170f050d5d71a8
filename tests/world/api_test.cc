// SPDX-License-Identifier: GPL-2.0-or-later
//
// Stage's interface as clients use it: names and signatures (checked mostly by the compiler), and
// common idioms. Like most clients, this file has using-directives for both namespaces.

#include <sys/time.h>

#include <algorithm>

#include "api_testing.hh"

// Clients nest FOR_EACH.
#pragma GCC diagnostic ignored "-Wshadow"

namespace {

// ---- functions, constants, types ----------------------------------------------------------------

TEST(Api, Functions) {
  Has<void (*)(int*, char***)>(&Init);
  Has<bool (*)()>(&InitDone);
  Has<const char* (*)()>(&Version);
  Has<unsigned int (*)()>(&FullVersion);
  Has<void (*)()>(&RegisterModels);
  Has<double (*)(double)>(&rtod);
  Has<double (*)(double)>(&dtor);
  Has<double (*)(double)>(&normalize);
  Has<int (*)(int)>(&sgn);
  Has<double (*)(double)>(&sgn);
  Has<double (*)(double, double, double)>(&constrain);
  Has<int (*)(const string&, vector<vector<point_t> >&)>(&polys_from_image_file);
  Has<point_t* (*)()>(&unit_square_points_create);

  EXPECT_EQ(rtod(M_PI), 180);
  EXPECT_EQ(dtor(180), M_PI);
  EXPECT_EQ(normalize(M_PI), M_PI);
  EXPECT_EQ(normalize(-M_PI), -M_PI);
  EXPECT_NEAR(normalize(5), 5 - 2 * M_PI, 1e-15);
  EXPECT_EQ(sgn(0), 1);
  EXPECT_EQ(sgn(-2), -1);
  EXPECT_EQ(sgn(-0.5), -1.0);
  EXPECT_EQ(constrain(5, 0, 2), 2);
  EXPECT_GT(FullVersion(), 40300u);

  point_t* square = unit_square_points_create();
  EXPECT_TRUE(square[0] == point_t(0, 0) && square[1] == point_t(1, 0) &&
              square[2] == point_t(1, 1) && square[3] == point_t(0, 1));
  delete[] square;

  vector<int> numbers = {1, 2, 1, 3};
  EraseAll(1, numbers);
  EXPECT_EQ(numbers, (vector<int>{2, 3}));
}

TEST(Api, ConstantsAndTypes) {
  EXPECT_EQ(thousand * thousand, million);
  EXPECT_EQ(thousand * million, billion);
  EXPECT_EQ(FiducialNone, 0);
  for (const char* text : {COPYRIGHT, AUTHORS, WEBSITE, DESCRIPTION, LICENSE})
    EXPECT_GT(strlen(text), 0u);

  Is<uint32_t>(Stg::id_t());
  Is<double>(meters_t());
  Is<double>(radians_t());
  Is<double>(kg_t());
  Is<double>(joules_t());
  Is<double>(watts_t());
  Is<unsigned long>(msec_t());
  Is<uint64_t>(usec_t());
  Is<struct timeval>(Stg::time_t());
  Is<Model* (*)(World*, Model*, const string&)>(creator_t());
  Is<int (*)(Model*, void*)>(model_callback_t());
  Is<int (*)(World*, void*)>(world_callback_t());
  Is<bool (*)(Model*, const Model*, const void*)>(ray_test_func_t());

  fov_t fov;
  fov.range = Bounds(0, 1);
  fov.angle = 1;
  rotrect_t rectangle;
  rectangle.pose = Pose(1, 2, 3, 4);
  rectangle.size = Size(1, 2, 3);
  EXPECT_EQ(fov.range.max + rectangle.pose.a, 5);
}

TEST(Api, Macros) {
  vector<int> numbers = {1, 2, 3};
  const vector<int>& constant = numbers;
  int sum = 0;
  FOR_EACH(outer, numbers) FOR_EACH(inner, constant) sum += *outer * *inner;
  EXPECT_EQ(sum, 36);
  FOR_EACH(it, numbers)* it = 7;
  EXPECT_EQ(numbers, (vector<int>{7, 7, 7}));
  VAR(copy, numbers);
  Is<vector<int> >(copy);

  testing::internal::CaptureStderr();
  PRINT_ERR("none");
  PRINT_ERR1("%d", 1);
  PRINT_ERR2("%d %d", 1, 2);
  PRINT_ERR3("%d %d %d", 1, 2, 3);
  PRINT_ERR4("%d %d %d %d", 1, 2, 3, 4);
  PRINT_ERR5("%d %d %d %d %s", 1, 2, 3, 4, "five");
  const string errors = testing::internal::GetCapturedStderr();
  EXPECT_EQ(errors.find("\033[41merr\033[0m: none ("), 0u) << errors;
  EXPECT_NE(errors.find("1 2 3 4 five ("), string::npos) << errors;

  testing::internal::CaptureStdout();
  PRINT_WARN("none");
  PRINT_WARN1("%d", 1);
  PRINT_WARN2("%d %d", 1, 2);
  PRINT_WARN3("%d %d %d", 1, 2, 3);
  PRINT_WARN4("%d %d %d %d", 1, 2, 3, 4);
  PRINT_WARN5("%d %d %d %d %d", 1, 2, 3, 4, 5);
  PRINT_MSG("none");
  PRINT_MSG1("%d", 1);
  PRINT_MSG2("%d %d", 1, 2);
  PRINT_MSG3("%d %d %d", 1, 2, 3);
  PRINT_MSG4("%d %d %d %d", 1, 2, 3, 4);
  PRINT_MSG5("%d %d %d %d %d", 1, 2, 3, 4, 5);
  PRINT_DEBUG("none");
  PRINT_DEBUG1("%d", no_such_thing);
  PRINT_DEBUG2("%d", no, such);
  PRINT_DEBUG3("%d", no, such, thing);
  PRINT_DEBUG4("%d", no, such, thing, here);
  PRINT_DEBUG5("%d", no, such, thing, here, either);
  const string output = testing::internal::GetCapturedStdout();
  EXPECT_EQ(output.find("\033[44mwarn\033[0m: none ("), 0u) << output;
  EXPECT_NE(output.find("Stage: none\n"), string::npos) << output;
  EXPECT_EQ(output.find("debug"), string::npos) << output;
}

// ---- value classes ------------------------------------------------------------------------------

TEST(Api, Colors) {
  Has<bool (Color::*)(const Color&) const>(&Color::operator==);
  Has<bool (Color::*)(const Color&) const>(&Color::operator!=);
  Has<Color (*)()>(&Color::RandomColor);
  Has<void (Color::*)(const char*) const>(&Color::Print);
  Has<const Color& (Color::*)(Worldfile*, int)>(&Color::Load);
  static_assert(!is_convertible<string, Color>::value, "explicit");
  Color c;
  EXPECT_EQ(c, Color::red);
  c = Color(0.1, 0.2, 0.3);
  EXPECT_EQ(c.r + c.g + c.b + c.a, 1.6);
  EXPECT_EQ(Color("blue"), Color::blue);
  EXPECT_EQ(Color(string("no such colour")), Color(1, 0, 0, 1));
  for (const Color& one : {Color::green, Color::yellow, Color::magenta, Color::cyan})
    EXPECT_NE(one, Color::red);
}

TEST(Api, Poses) {
  Has<Pose (*)(meters_t, meters_t, meters_t, meters_t)>(&Pose::Random);
  Has<void (Pose::*)(const char*) const>(&Pose::Print);
  Has<string (Pose::*)() const>(&Pose::String);
  Has<bool (Pose::*)() const>(&Pose::IsZero);
  Has<void (Pose::*)()>(&Pose::Zero);
  Has<Pose (Pose::*)(const Pose&) const>(&Pose::operator+);
  Has<bool (Pose::*)(const Pose&) const>(&Pose::operator<);
  Has<bool (Pose::*)(const Pose&) const>(&Pose::operator==);
  Has<bool (Pose::*)(const Pose&) const>(&Pose::operator!=);
  Has<meters_t (Pose::*)(const Pose&) const>(&Pose::Distance);
  Has<Pose& (Pose::*)(Worldfile*, int, const char*)>(&Pose::Load);
  Has<void (Pose::*)(Worldfile*, int, const char*)>(&Pose::Save);
  static_assert(has_virtual_destructor<Pose>::value, "");
  static_assert(sizeof(Pose) == 4 * sizeof(double) + std::max(sizeof(void*), alignof(Pose)), "");

  static_assert(is_base_of<Pose, Velocity>::value, "");
  Has<void (Velocity::*)(const char*) const>(&Velocity::Print);
  Has<Velocity& (Velocity::*)(Worldfile*, int, const char*)>(&Velocity::Load);

  Pose p;
  EXPECT_TRUE(p.IsZero());
  p = {1, 2, 3, 0.5};
  EXPECT_EQ(p.x + p.y + p.z + p.a, 6.5);
  EXPECT_EQ(p.String(), "[ 1.000 2.000 3.000 0.500 ]");
  EXPECT_EQ((Pose(1, 0, 0, 0) + Pose(1, 1, 0, 0)), Pose(2, 1, 0, 0));
  EXPECT_EQ(Pose(0, 0, 9, 0).Distance(Pose(3, 4, 0, 1)), 5);
  EXPECT_TRUE(Velocity().IsZero());
  EXPECT_EQ(Velocity(1, 2, 3, 4).a, 4);
}

TEST(Api, SizesBoundsAndPoints) {
  Has<void (Size::*)()>(&Size::Zero);
  Has<Size& (Size::*)(Worldfile*, int, const char*)>(&Size::Load);
  Has<void (Size::*)(Worldfile*, int, const char*) const>(&Size::Save);
  const Size size;
  EXPECT_EQ(size.x + size.y + size.z, 1.8);
  EXPECT_EQ(Size(1, 2, 3).z, 3);

  Has<void (Geom::*)()>(&Geom::Zero);
  Has<void (Geom::*)(const char*) const>(&Geom::Print);
  Geom geom(Pose(1, 2, 3, 4), Size(5, 6, 7));
  EXPECT_EQ(geom.pose.y + geom.size.y, 8);
  geom.Zero();
  EXPECT_EQ(geom.size.x + geom.pose.x, 0);
  EXPECT_EQ(Geom().size.z, 1);

  Has<Bounds& (Bounds::*)(Worldfile*, int, const char*)>(&Bounds::Load);
  Has<double (Bounds::*)(double)>(&Bounds::Constrain);
  EXPECT_EQ(Bounds(-1, 1).Constrain(-3), -1);
  EXPECT_EQ(Bounds().max, 0);
  const bounds3d_t box(Bounds(0, 1), Bounds(2, 3), Bounds(4, 5));
  EXPECT_EQ(box.x.max + box.y.min + box.z.min + bounds3d_t().x.max, 7);

  point_t p(1, 2);
  p += point_t(-1, 5);
  EXPECT_TRUE(p == point_t(0, 7)) << "also if x becomes 0";
  EXPECT_TRUE(point_t() < p);
  EXPECT_EQ(point3_t(1, 2, 3).z + point3_t().x, 3);
  EXPECT_TRUE(point_int_t(1, 2) == point_int_t(1, 2) && point_int_t() < point_int_t(0, 1));
}

TEST(Api, Rays) {
  const Ray none;
  EXPECT_TRUE(!none.mod && none.origin.IsZero() && none.range == 0 && !none.func && !none.arg &&
              none.ztest);
  const Ray ray(nullptr, Pose(1, 2, 3, 4), 5.0, nullptr, &none, false);
  EXPECT_EQ(ray.arg, &none);
  EXPECT_FALSE(ray.ztest);
  const RaytraceResult nothing, result(Pose(1, 2, 3, 4), nullptr, Color::blue, 7);
  EXPECT_EQ(nothing.mod, nullptr);
  EXPECT_EQ(result.pose.x + result.range, 8);
  EXPECT_EQ(result.color, Color::blue);
}

TEST(Api, ControllerArguments) {
  CtrlArgs arguments("wander fast", "--slow");
  arguments.worldfile[0] = 'W';  // option parsers modify arguments
  EXPECT_EQ(arguments.worldfile + arguments.cmdline, "Wander fast--slow");
}

// ---- Ancestor and World -------------------------------------------------------------------------

TEST(Api, Ancestor) {
  Has<vector<Model*>& (Ancestor::*)()>(&Ancestor::GetChildren);
  Has<void (Ancestor::*)(model_callback_t, void*)>(&Ancestor::ForEachDescendant);
  Has<const char* (Ancestor::*)() const>(&Ancestor::Token);
  Has<const string& (Ancestor::*)() const>(&Ancestor::TokenStr);
  Has<void (Ancestor::*)(const string&)>(&Ancestor::SetToken);
  Has<Pose (Ancestor::*)() const>(&Ancestor::GetGlobalPose);
  Has<void (Ancestor::*)(Model*)>(&Ancestor::AddChild);
  Has<void (Ancestor::*)(Model*)>(&Ancestor::RemoveChild);
  Ancestor ancestor;
  string key("key");
  ancestor.SetProperty(key, &ancestor);
  EXPECT_EQ(ancestor.GetProperty(key), &ancestor);
}

TEST(Api, World) {
  static_assert(is_base_of<Ancestor, World>::value, "");
  static_assert(has_virtual_destructor<World>::value, "");
  static_assert(World::DEFAULT_PPM == 50, "");
  Has<bool (World::*)(const string&)>(&World::Load);
  Has<bool (World::*)(istream&, const string&)>(&World::Load);
  Has<void (World::*)()>(&World::UnLoad);
  Has<void (World::*)()>(&World::Reload);
  Has<bool (World::*)(const char*)>(&World::Save);
  Has<Worldfile* (World::*)()>(&World::GetWorldFile);
  Has<Model* (World::*)(Model*, const string&)>(&World::CreateModel);

  Has<void (*)()>(&World::Run);
  Has<bool (*)()>(&World::UpdateAll);
  Has<bool (World::*)()>(&World::Update);
  Has<void (World::*)()>(&World::Start);
  Has<void (World::*)()>(&World::Stop);
  Has<void (World::*)()>(&World::TogglePause);
  Has<bool (World::*)() const>(&World::Paused);
  Has<bool World::*>(&World::paused);
  Has<usec_t World::*>(&World::sim_interval);
  Has<usec_t (World::*)() const>(&World::SimTimeNow);
  Has<uint64_t (World::*)()>(&World::UpdateCount);
  Has<uint64_t (World::*)() const>(&World::GetUpdateCount);
  Has<string (World::*)() const>(&World::ClockString);
  Has<void (World::*)(bool)>(&World::ShowClock);
  Has<bool (World::*)() const>(&World::TestQuit);
  Has<void (World::*)()>(&World::Quit);
  Has<void (World::*)()>(&World::QuitAll);
  Has<void (World::*)()>(&World::CancelQuit);
  Has<void (World::*)()>(&World::CancelQuitAll);
  Has<bool (World::*)()>(&World::PastQuitTime);
  Has<void (World::*)(world_callback_t, void*)>(&World::AddUpdateCallback);
  Has<int (World::*)(world_callback_t, void*)>(&World::RemoveUpdateCallback);
  Has<void (World::*)(unsigned int, usec_t, Model*, model_callback_t, void*)>(&World::Enqueue);
  Has<unsigned int (World::*)(Model*) const>(&World::GetEventQueue);
  Has<void (World::*)(Model*)>(&World::EnableEnergy);
  Has<void (World::*)(Model*)>(&World::DisableEnergy);
  Has<vector<string>*>(&World::args);
  Has<string*>(&World::ctrlargs);

  Has<Model* (World::*)(const string&) const>(&World::GetModel);
  Has<const set<Model*> (World::*)() const>(&World::GetAllModels);
  Has<Model* (World::*)()>(&World::GetGround);
  Has<Model * World::*>(&World::ground);
  Has<double (World::*)() const>(&World::Resolution);
  Has<const bounds3d_t& (World::*)() const>(&World::GetExtent);
  Has<RaytraceResult (World::*)(const Ray&)>(&World::Raytrace);
  Has<RaytraceResult (World::*)(const Pose&, const meters_t, const ray_test_func_t, const Model*,
                                const void*, const bool)>(&World::Raytrace);
  Has<void (World::*)(const Pose&, const meters_t, const radians_t, const ray_test_func_t,
                      const Model*, const void*, const bool, vector<RaytraceResult>&)>(
      &World::Raytrace);
  Has<int32_t (World::*)(meters_t) const>(&World::MetersToPixels);
  Has<point_int_t (World::*)(const point_t&) const>(&World::MetersToPixels);
  Has<void (World::*)(Model*)>(&World::AddModel);
  Has<void (World::*)(Model*)>(&World::RemoveModel);
  Has<void (World::*)(Model*, const string&)>(&World::AddModelName);
  Has<void (World::*)(PowerPack*)>(&World::AddPowerPack);
  Has<void (World::*)(PowerPack*)>(&World::RemovePowerPack);
  Has<void (World::*)(double, double, double, double)>(&World::RecordRay);
  Has<void (World::*)()>(&World::ClearRays);
  Has<void (World::*)(Model*)>(&World::Log);

  Has<bool (World::*)() const>(&World::IsGUI);
  Has<void (World::*)()>(&World::Redraw);
  Has<void (World::*)()>(&World::NeedRedraw);
  Has<Model* (World::*)() const>(&World::RecentlySelectedModel);
  Has<void (World::*)(Color)>(&World::PushColor);
  Has<void (World::*)(double, double, double, double)>(&World::PushColor);
  Has<void (World::*)()>(&World::PopColor);
  Has<void (World::*)(Option*)>(&World::RegisterOption);
}

}  // namespace
